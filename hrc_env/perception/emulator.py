"""Keypoints without pixels: the projected truth with BlazePose's errors.

What is emulated, and where its size comes from, is said at every field of `EmulatorConfig`.
Errors are correlated in time (a detector is wrong in the same way for about half a second),
heavy-tailed, larger where a joint is hidden, and silent about it at hips, shoulders and
head. Now and then a camera exchanges left and right, or loses the worker.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrc_env.errors import ConfigError, check_shape
from hrc_env.geometry.cameras import PinholeCamera, projections
from hrc_env.geometry.sight import Surroundings
from hrc_env.optics.lens import lens_row
from hrc_env.perception.emulator_kernel import CENTRE, emulate_batch
from hrc_env.perception.noise import ERROR, VISIBILITY
from hrc_env.records import Keypoints, WorkerTruth
from hrc_env.skeleton import JOINT, JOINTS, MIRROR, N_JOINTS
from hrc_env.typing import Bools, Floats, Ints

Generators = Sequence[np.random.Generator]


@dataclass(frozen=True, slots=True)
class EmulatorConfig:
    """Sizes of the detector's errors; shares are of the worker's stature in the image.

    "Measured" refers to BlazePose `full` on rendered workers: its median error against its
    visibility (`perception.noise`); a median of a share m means a standard deviation of
    m / 1.177 of each coordinate.
    """

    stature_m: float = 1.75
    """Stature that makes pixels out of shares [m]; an adult's."""
    seen_error: float = 0.011
    """Standard deviation of a visible joint's coordinates; measured median 1.3 % of stature."""
    hidden_arm_error: float = 0.035
    """The same of hidden elbows and wrists; measured median 4.1 % below visibility 0.2."""
    hidden_leg_error: float = 0.026
    """The same of hidden knees, ankles and feet; measured median 3.1 % at 0.2 to 0.5."""
    hidden_trunk_error: float = 0.02
    """The same of hidden hips, shoulders and nose: a judgement, between seen and hidden limbs,
    as the network infers them from the rest of the body."""
    seen_confidence: float = 0.98
    """Visibility that the network reports of visible joints [0..1]; measured 0.97."""
    hidden_arm_confidence: float = 0.12
    """The same of hidden elbows and wrists; measured 0.15 and 0.09."""
    hidden_leg_confidence: float = 0.55
    """The same of hidden knees, ankles and feet; measured 0.5 to 0.8, weakly informative."""
    hidden_trunk_confidence: float = 0.97
    """The same of hidden hips, shoulders and nose: it was measured never to drop."""
    seen_tail: float = 0.5
    """Spread of the logarithm of the error's size; measured 90th percentile / median = 2.4."""
    hidden_tail: float = 1.1
    """The same of hidden joints; measured 90th percentile / median = 4.6."""
    max_error: float = 0.25
    """No error is larger than this: the network's window holds one body."""
    correlation_s: float = 0.5
    """How long the slow part of an error lasts [s]; measured about half a second."""
    slow_share: float = 0.8
    """Share of the error's variance that is slow; the rest is new in every image. Grey-level
    noise alone moves landmarks by 0.3 % of stature in a steady crop."""
    swap_share: float = 0.02
    """Share of the time that a camera exchanges left and right; a judgement, 1 to 5 %."""
    swap_s: float = 0.2
    """Mean length of such a burst [s]; a judgement: about 5 images at 25 Hz."""
    miss_share: float = 0.01
    """Share of the time that a camera loses a visible worker; measured 1 % in the lab."""
    miss_s: float = 0.12
    """Mean length of such a loss [s]; a judgement."""
    min_joints: int = 6
    """Fewer joints (of 15) in sight of a camera, and it does not see the worker."""
    outside_confidence: float = 0.1
    """Joints outside the image are guesses, at most this visible; as in `EyesConfig`."""

    def __post_init__(self) -> None:
        for name in ("seen", "hidden_arm", "hidden_leg", "hidden_trunk"):
            confidence = getattr(self, f"{name}_confidence")
            error = getattr(self, f"{name}_error")
            if not 0 < confidence < 1:
                raise ConfigError(f"{name}_confidence must be in (0, 1), got {confidence}.")
            if not error >= 0:
                raise ConfigError(f"{name}_error must not be negative, got {error}.")
        for name in ("slow_share", "swap_share", "miss_share"):
            if not 0 <= getattr(self, name) <= 1:
                raise ConfigError(f"{name} must be in [0, 1], got {getattr(self, name)}.")
        for name in ("correlation_s", "swap_s", "miss_s", "stature_m"):
            if not getattr(self, name) > 0:
                raise ConfigError(f"{name} must be positive, got {getattr(self, name)}.")


@dataclass(frozen=True, slots=True)
class EmulatorState:
    """What the detector's errors remember from image to image."""

    slow: Floats
    """(B, C, W, J, 2) slow part of the errors, in standard deviations."""
    size: Floats
    """(B, C, W, J) slow logarithm of the errors' size, in standard deviations."""
    swapped: Bools
    """(B, C, W) whether left and right are exchanged now."""
    missed: Bools
    """(B, C, W) whether the worker is lost now."""
    dt_s: float
    """Time between images [s]."""


def make_state(
    batch: int, n_cameras: int, n_workers: int, dt_s: float, config: EmulatorConfig
) -> EmulatorState:
    """A state for `batch` environments with images `dt_s` apart; `reset` it before use."""
    if not dt_s > 0:
        raise ConfigError(f"The time between images must be positive, got {dt_s} s.")
    lead = (batch, n_cameras, n_workers)
    return EmulatorState(
        slow=np.zeros((*lead, N_JOINTS, 2)),
        size=np.zeros((*lead, N_JOINTS)),
        swapped=np.zeros(lead, bool),
        missed=np.zeros(lead, bool),
        dt_s=dt_s,
    )


def reset(state: EmulatorState, ids: Ints, rngs: Generators, config: EmulatorConfig) -> None:
    """Begin environments `ids` anew with errors drawn from how they are in the long run."""
    for b in ids:
        state.slow[b] = rngs[b].standard_normal(state.slow.shape[1:])
        state.size[b] = rngs[b].standard_normal(state.size.shape[1:])
        state.swapped[b] = rngs[b].random(state.swapped.shape[1:]) < config.swap_share
        state.missed[b] = rngs[b].random(state.missed.shape[1:]) < config.miss_share


def emulate(
    state: EmulatorState,
    rngs: Generators,
    truth: WorkerTruth,
    surroundings: Surroundings,
    cameras: tuple[PinholeCamera, ...],
    config: EmulatorConfig,
) -> Keypoints:
    """What the detector would report of the workers in one image of every camera.

    Args:
        state: of the errors, advanced by one image in place.
        rngs: one generator per environment.
        truth: (B, W, ...) the workers; their capsules hide joints of their own and of others.
        surroundings: (B, ...) the room, what is carried and the robot, which hide joints too.
        cameras: the rig (C).
        config: as given to `make_state`.

    Returns:
        Keypoints in pixels of the images, as lenses bend them, with NaN, 0 and infinity where a
        camera does not see a worker.
    """
    batch, n_cameras, n_workers = state.swapped.shape
    shape = (batch, n_cameras, n_workers, N_JOINTS)
    robot = surroundings.capsules_world
    check_shape("surroundings.capsules_world", (len(robot),), (batch,), "environments")
    normals, uniforms = np.empty((*shape, 5)), np.empty((*shape[:3], 2))
    for rng, normal, uniform in zip(rngs, normals, uniforms, strict=True):
        rng.standard_normal(out=normal)
        rng.random(out=uniform)
    P, eyes_world, image, bending = _rig(cameras)
    scalars, per_joint = _settings(config, state.dt_s)
    out = Keypoints(np.empty((*shape, 2)), np.empty(shape), np.empty(shape))
    emulate_batch(
        state.slow, state.size, state.swapped, state.missed, normals, uniforms,
        np.ascontiguousarray(truth.joints_world), np.ascontiguousarray(truth.capsules_world),
        np.ascontiguousarray(truth.capsule_radius_m), surroundings.still, surroundings.moving,
        robot, surroundings.capsule_radius_m,
        P, eyes_world, image, bending, scalars, per_joint, MIRROR, VISIBILITY, ERROR,
        out.px, out.confidence, out.sigma_px,
    )  # fmt: skip
    return out


def without_names(keypoints: Keypoints, rngs: Generators) -> Keypoints:
    """The same poses, in every camera in an order of its own: nobody wears a name.

    Args:
        keypoints: (B, C, W, J, ...).
        rngs: one generator per environment.
    """
    batch, n_cameras, n_workers = keypoints.confidence.shape[:3]
    order = np.tile(np.arange(n_workers), (batch, n_cameras, 1))
    for b in range(batch):
        order[b] = rngs[b].permuted(order[b], axis=-1)
    pick = (np.arange(batch)[:, None, None], np.arange(n_cameras)[:, None], order)
    parts = (keypoints.px[pick], keypoints.confidence[pick], keypoints.sigma_px[pick])
    return Keypoints(*parts, keypoints.time_s)


@functools.lru_cache(maxsize=16)
def _rig(cameras: tuple[PinholeCamera, ...]) -> tuple[Floats, Floats, Floats, Floats]:
    """Projections (C, 3, 4), eyes (C, 3), width, height, focal length (C, 3), lenses (C, 12)."""
    image = [(camera.width_px, camera.height_px, camera.K[0, 0]) for camera in cameras]
    eyes_world = np.stack([camera.eye_world for camera in cameras])
    bending = np.stack([_bending(camera) for camera in cameras])
    return projections(cameras), np.ascontiguousarray(eyes_world), np.array(image, float), bending


def _bending(camera: PinholeCamera) -> Floats:
    """(12,) a lens with what makes pixels of its numbers; zeros for a pinhole."""
    if camera.lens is None:
        return np.zeros(CENTRE + 2)
    K = camera.K
    return np.concatenate([lens_row(camera.lens), K[[0, 1], [0, 1]], K[:2, 2]])


@functools.lru_cache(maxsize=16)
def _settings(config: EmulatorConfig, dt_s: float) -> tuple[Floats, Floats]:
    """Numbers for the kernel: scalars in its order, and (2 seen/hidden, 3, J) per joint."""
    keep = np.exp(-dt_s / config.correlation_s)
    scalars = [
        config.stature_m,
        keep,
        np.sqrt(1 - keep**2),
        np.sqrt(config.slow_share),
        np.sqrt(1 - config.slow_share),
        config.max_error,
        *_burst(config.swap_share, config.swap_s, dt_s),
        *_burst(config.miss_share, config.miss_s, dt_s),
        config.min_joints,
        config.outside_confidence,
    ]
    per_joint = np.empty((2, 3, N_JOINTS))
    per_joint[0] = [[config.seen_error], [_logit(config.seen_confidence)], [config.seen_tail]]
    for name in JOINTS:
        group = _GROUP.get(name.rsplit("_", 1)[-1], "trunk")
        per_joint[1, :, JOINT[name]] = (
            getattr(config, f"hidden_{group}_error"),
            _logit(getattr(config, f"hidden_{group}_confidence")),
            config.hidden_tail if group != "trunk" else config.seen_tail,
        )
    return np.array(scalars, float), per_joint


_GROUP = {"elbow": "arm", "wrist": "arm", "knee": "leg", "ankle": "leg", "foot": "leg"}


def _burst(share: float, length_s: float, dt_s: float) -> tuple[float, float]:
    """Chances per image that a burst begins and that it ends, for a share of the time."""
    if share >= 1:
        return 1.0, 0.0
    end = min(dt_s / length_s, 1.0)
    return min(end * share / (1 - share), 1.0), end


def _logit(p: float) -> float:
    return float(np.log(p / (1 - p)))
