"""The shield of a robot that knows the true bodies of workers, as an upper bound for perception.

No estimate has such knowledge: beliefs contain joints, and the capsules around them are inferred.
Only the price study uses this shield. It reads the truth of one simulation directly, so that the
belief of its robots remains free of true bodies.
"""

from collections.abc import Mapping

import numpy as np

from hrc_env.belief import Belief
from hrc_env.core.records import WorkerMotion
from hrc_env.core.typing import Capsules, Floats, JointVelocities, Velocities3
from hrc_env.geometry.enclosure import BodyCapsules
from hrc_env.motion import generator
from hrc_env.safety.built_in import KnownBodies, limit_command
from hrc_env.safety.config import ShieldConfig
from hrc_env.simulation import Simulation
from hrc_env.worker.body import Body, worker_truth


class TrueBodyShield:
    """A shield that receives the true capsules of the workers of one simulation.

    It has neither a margin for the estimated body (`Enclosure.protrusion_m`) nor one for the
    error of an estimate; of Z_d, only its lower bound `ShieldConfig.min_uncertainty_m` remains.

    Args:
        part: the simulation.
        config: settings of the shield.
    """

    def __init__(self, part: Simulation, config: ShieldConfig) -> None:
        self.part, self.config = part, config

    def __call__(
        self, belief: Belief, velocities: JointVelocities, dt_s: float
    ) -> tuple[JointVelocities, Mapping[str, Floats]]:
        """Return the shielded command and infos (`hrc_env.safety.shield.Shield`)."""
        known = read_true_bodies(self.part)
        return limit_command(belief, velocities, dt_s, self.config, known)


def read_true_bodies(part: Simulation) -> KnownBodies:
    """Return the current true bodies of all workers of a simulation."""
    motion = generator.current(part.motion)
    truth = worker_truth(part.bodies, motion)
    velocity = find_true_velocities(part.bodies, motion, truth.capsules_world)
    return KnownBodies(BodyCapsules(truth.capsules_world, truth.capsule_radius_m), velocity)


def find_true_velocities(body: Body, motion: WorkerMotion, ends_world: Capsules) -> Velocities3:
    """Return the velocities v + omega x r of the ends of capsules (..., K, 2, 3) [m/s].

    Args:
        body: measurements of the bodies.
        motion: poses and velocities of the segments (..., S, 3 or 4).
        ends_world: ends of the capsules (..., K, 2, 3) [m].
    """
    of = body.capsule_segment
    arm = ends_world - motion.position_world[..., of, None, :]
    turning = np.cross(motion.angular_velocity_world[..., of, None, :], arm)
    return np.asarray(motion.velocity_world[..., of, None, :] + turning)
