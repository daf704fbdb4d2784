"""A shield whose protective distances can all be made wider or narrower by the same margin."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from hrc_env.belief import Belief
from hrc_env.core.typing import Floats, JointVelocities
from hrc_env.safety.shield import SHIELDS

SHIELD = "qp"
"""The one whose margin is sought, by its name."""


@dataclass(slots=True)
class Widened:
    """`SHIELD` for a robot that is thicker by a margin, which may be negative: so much more is
    kept between any of its capsules and any body. It is told `covariance` times the estimator's
    covariances; nobody else is."""

    covariance: float = 1.0
    margin_m: float = 0.0
    """Whoever plays changes it between episodes."""

    def __call__(
        self, now: Belief, wanted: JointVelocities, dt_s: float
    ) -> tuple[JointVelocities, Mapping[str, Floats]]:
        """What the shield makes of a command (`hrc_env.safety.shield.Shield`)."""
        thicker = replace(now.robot, capsule_radius_m=now.robot.capsule_radius_m + self.margin_m)
        told = replace(now.estimate, cov_world=self.covariance * now.estimate.cov_world)
        return SHIELDS[SHIELD](replace(now, robot=thicker, estimate=told), wanted, dt_s)
