"""What is true at the end of a step, and what the robot believed: one step of a batch.

Distances are between the robot's capsules and the worker's true capsules, as in the cost. A
directed speed is by how much one body's motion of this step narrowed the gap while the other is
held where it is now: positive is towards the other.
"""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.typing import Capsules, Floats, Points3
from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.motion import generator
from hrc_env.simulation import Simulation
from hrc_env.worker.body import worker_truth


@dataclass(frozen=True, slots=True)
class Scene:
    """Where robot and worker truly are."""

    robot_world: Capsules
    """(B, K, 2, 3) [m]."""
    robot_radius_m: Floats
    """(K,)."""
    worker_world: Capsules
    """(B, L, 2, 3) [m]."""
    worker_radius_m: Floats
    """(B, L)."""
    joints_world: Points3
    """(B, J, 3) [m]."""


@dataclass(frozen=True, slots=True)
class Step:
    """What happened in a step, per environment."""

    true_separation_m: Floats
    """(B,) at the end of the step."""
    believed_separation_m: Floats
    """(B,) the same as the robot believes it; infinite where it knows of nobody."""
    robot_mps: Floats
    """(B,) the robot's speed towards the worker."""
    worker_mps: Floats
    """(B,) the worker's speed towards the robot."""
    error_m: Floats
    """(B, J) between the estimated and the true joints."""


def scene_of(part: Simulation) -> Scene:
    """Where everybody is now, in a simulation with one worker."""
    truth = worker_truth(part.bodies, generator.current(part.motion))
    return Scene(
        chains.capsules(part.chain, part.physics.q),
        part.chain.capsule_radius_m,
        truth.capsules_world[:, 0],
        truth.capsule_radius_m[:, 0],
        truth.joints_world[:, 0],
    )


def judge(part: Simulation, before: Scene, now: Scene) -> Step:
    """One step of a simulation, from the scenes at its beginning and its end."""
    dt_s, gap_m = part.config.ctrl_dt, _gap(now, now)
    return Step(
        true_separation_m=gap_m,
        believed_separation_m=part.belief.separation.distance_m[:, 0],
        robot_mps=(_gap(before, now) - gap_m) / dt_s,
        worker_mps=(_gap(now, before) - gap_m) / dt_s,
        error_m=np.linalg.norm(part.estimate.mean_world[:, 0] - now.joints_world, axis=-1),
    )


def _gap(robot: Scene, worker: Scene) -> Floats:
    """(B,) between the robot of one scene and the worker of another [m]."""
    return least_separation(
        robot.robot_world, robot.robot_radius_m, worker.worker_world, worker.worker_radius_m
    ).distance_m
