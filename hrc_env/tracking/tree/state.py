"""The state of Gaussians on the kinematic tree, one for every hypothesis about every worker.

The joints of a body share their errors: with one view the depth of all of them is wrong together.
So the whole body is one Gaussian whose dependencies are the kinematic tree's: a prediction with
exact moments (`predict`), a robust search (`search`), one exact update and a step from the mode to
the mean (`update`), with bones of known length on every edge (`bone_lengths`).
"""

import functools
from typing import Any

import numpy as np

from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.models.acquisition import STANDING_M
from hrc_env.tracking.models.askew import PAIR
from hrc_env.tracking.models.motion import STANDING_COUNT, damped_joints, whole_body_noise
from hrc_env.tracking.models.noise import N_SUMS
from hrc_env.tracking.tree.bone_lengths import population_edges

_J = N_JOINTS
TREE = np.dtype(
    [
        # mean position [m] and velocity [m/s] in the world, marginal covariances, slopes on parents
        ("body", "f8", (_J, 6)), ("cov", "f8", (_J, 6, 6)), ("slope", "f8", (_J, 6, 6)),
        # since a measurement supported the joint [s]; updates in a row in which views did not
        ("age_s", "f8", (_J,)), ("conflict", "i8", (_J,)), ("tracked", "?"),
        # of who is not tracked: updates in which one view alone has shown somebody; of who is: how
        # much larger and farther off, as a share, the body that one view has begun may be, or 0
        ("waited", "i8"), ("size_std", "f8"),
        # the two cameras that alone see the body; how far off it may be for what is known of their
        # turns, as a whole [m^2]
        ("pair", PAIR), ("displaced_m2", "f8", (3, 3)),
        # mean place on the body [m]: forward, left, up of the torso; updates that went into it
        ("offset", "f8", (_J, 3)), ("offset_count", "f8", (_J,)),
        # from each joint to its parent [m], [m^2]
        ("bone_length", "f8", (_J,)), ("bone_variance", "f8", (_J,)),
        # log-probability of the hypothesis; what `anatomy` says of its pose, a part of that
        ("log_weight", "f8"), ("pose_log_prior", "f8"),
    ],
    align=True,
)  # fmt: skip
"""The Gaussian of one hypothesis about one worker, and what it has learnt of them."""
VIEW = np.dtype(
    [
        # probability that the camera exchanges left and right
        ("swap_chance", "f8"),
        # updates since it saw the worker; for which it is still not asked about swaps
        ("blind", "i8"), ("believed", "i8"),
    ],
    align=True,
)  # fmt: skip
"""What a hypothesis holds of one camera."""
NOISE = np.dtype(
    [
        # learnt factor on the variance that the detector reports; what it is learnt from
        ("factor", "f8"), ("sums", "f8", (N_SUMS,)),
        # last residuals in reported standard deviations, fading; 0: none
        ("last", "f8", (2,)),
    ],
    align=True,
)  # fmt: skip
"""What a hypothesis holds of one joint in one camera, as in `models.noise`."""


def forget_trees(trees: Any, views: Any, noise: Any, ids: Ints, config: ParticleConfig) -> None:
    """Put environments `ids` of trees (B, W, H), and of what they hold of cameras, to the prior."""
    fresh = np.zeros((), TREE)
    fresh["body"][:, :3] = config.prior_mean_world
    fresh["cov"] = np.eye(6)
    fresh["cov"][:, :3, :3] = config.prior_std_m**2 * np.eye(3)
    fresh["age_s"] = config.max_age_s
    fresh["offset"], fresh["offset_count"] = STANDING_M, STANDING_COUNT
    fresh["bone_length"], fresh["bone_variance"] = population_edges()
    trees[ids] = fresh
    views[ids] = np.array((config.swap_begins, 0, 0), VIEW)
    factor = np.clip(1.0, *config.noise_bounds)  # the detector is believed
    noise[ids] = np.array((factor, np.zeros(N_SUMS), np.zeros(2)), NOISE)


@functools.lru_cache(maxsize=16)
def motion(dt_s: float, damping: float, acceleration: float) -> tuple[Floats, ...]:
    """F, travel, Q (J, 2, 2) and shared noise (2, 2), as `tree.predict.predict_tree` takes them."""
    F, Q = damped_joints(dt_s, damping, acceleration)
    travel = np.array([[1.0, dt_s], [0.0, 1.0]]) - F
    return F, travel, Q, whole_body_noise(dt_s, acceleration)
