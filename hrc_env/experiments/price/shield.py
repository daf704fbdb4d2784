"""A shield with one margin that increases or reduces all of its protective distances."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from hrc_env.belief import Belief
from hrc_env.core.typing import Floats, JointVelocities
from hrc_env.safety.shield import SHIELDS

SHIELD = "qp"
"""Name of the shield to which the margin is added."""


@dataclass(slots=True)
class Widened:
    """The shield `SHIELD` for a robot with capsule radii that are increased by a margin.

    All protective distances therefore change by the margin, which may be negative. The shield
    receives the estimator's covariances multiplied by `covariance`.
    """

    covariance: float = 1.0
    """Factor by which the estimator's covariances are multiplied."""
    margin_m: float = 0.0
    """Margin [m], which may be changed between episodes."""

    def __call__(
        self, belief: Belief, wanted: JointVelocities, dt_s: float
    ) -> tuple[JointVelocities, Mapping[str, Floats]]:
        """Return the shielded command and infos (`hrc_env.safety.shield.Shield`)."""
        robot, estimate = belief.robot, belief.estimate
        robot = replace(robot, capsule_radius_m=robot.capsule_radius_m + self.margin_m)
        estimate = replace(estimate, cov_world=self.covariance * estimate.cov_world)
        return SHIELDS[SHIELD](replace(belief, robot=robot, estimate=estimate), wanted, dt_s)
