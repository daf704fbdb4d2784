"""Postures of workers near the robot, by the named choices of jobs.

Whole episodes at level `truth`, in which `scripted` drives to its goals whoever is near. Near is
nearer than 0.6 m to the robot, between true bodies. A posture is that one of `POSTURES` as which a
body counts most.
"""

import numpy as np
import pytest
from figures import Figure, count
from gymnasium.utils import seeding
from numpy.typing import NDArray

from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.core.results import Metric
from hrc_env.evaluation.intervals import estimate_ratio
from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.motion import generator
from hrc_env.perception.calibration import POSTURES
from hrc_env.perception.outline import posture_of
from hrc_env.settings import resolve_settings
from hrc_env.simulation import Simulation
from hrc_env.tasks import EPISODE_STEPS
from hrc_env.worker.body import worker_truth

NEAR_M, LOOK_EVERY = 0.6, 5
"""Where `scripted_slowed` slows down; steps from look to look."""
LOOKS = np.dtype([("posture", int), ("separation_m", float)])
SEEDS = range(49_000, 49_150)
"""Bounds come from seeds 0 to 799."""


def watch(jobs: str, scene: str, seeds: range) -> NDArray[np.void]:
    """Return (T, B) looks at the one worker of an episode of each seed."""
    settings = resolve_settings(perception="truth", scene=scene, config={"motion": {"jobs": jobs}})
    part = Simulation(len(seeds), settings)
    agent = make_agent("scripted", env_info(part))
    result = part.reset(np.arange(len(seeds)), [seeding.np_random(seed)[0] for seed in seeds])
    looks = []
    for step in range(EPISODE_STEPS):
        result = part.step(np.asarray(agent.act(result.observation), float))
        if step % LOOK_EVERY == 0:
            looks.append(_look(part))
    part.close()
    return np.stack(looks)


def _look(part: Simulation) -> NDArray[np.void]:
    truth = worker_truth(part.bodies, generator.current(part.motion))
    robot = chains.capsules(part.chain, part.physics.q), part.chain.capsule_radius_m
    worker = truth.capsules_world[:, 0], truth.capsule_radius_m[:, 0]
    seen = np.empty(part.batch, LOOKS)
    seen["separation_m"] = least_separation(*robot, *worker).distance_m
    bodies = zip(truth.joints_world[:, 0], truth.velocity_world[:, 0], strict=True)
    seen["posture"] = [np.argmax(posture_of(*body)) for body in bodies]
    return seen


def find_shares(looks: NDArray[np.void]) -> tuple[Metric, Metric]:
    """Return the share of time near the robot, and of that the share folded or kneeling."""
    is_near = looks["separation_m"] < NEAR_M
    is_low = looks["posture"] >= POSTURES.index("folded")
    near = estimate_ratio(is_near.sum(0), np.ones_like(is_near).sum(0), "share")
    return near, estimate_ratio((is_near & is_low).sum(0), is_near.sum(0), "share")


@pytest.mark.parametrize(("jobs", "least", "most"), [("low_work", 0.05, 0.4), ("framing", 0, 0.02)])
def test_low_work_brings_folded_bodies_to_the_robot_and_framing_does_not(jobs, least, most):
    near, low = find_shares(watch(jobs, "lab", range(40)))
    assert least <= low.value <= most
    assert 0.4 < near.value < 0.9


def test_shares_are_of_the_time_that_is_counted():
    looks = np.zeros((4, 1), LOOKS)
    looks["separation_m"][:, 0] = 0.1, 0.2, 0.9, 0.9
    looks["posture"][:, 0] = POSTURES.index("kneeling"), 0, 0, POSTURES.index("folded")
    assert [share.value for share in find_shares(looks)] == [0.5, 0.5]


@pytest.mark.long
@pytest.mark.parametrize("scene", ["lab", "site"])
def test_low_work_is_done_low_near_the_robot(scene, figures):
    near, low = find_shares(watch("low_work", scene, SEEDS))
    figures.hold(
        Figure(f"work.low_work.{scene}.near", near, least=0.5, most=0.8),
        Figure(f"work.low_work.{scene}.low_near", low, least=0.06, most=0.25),
    )


@pytest.mark.long
@pytest.mark.parametrize("scene", ["lab", "site"])
def test_framing_is_done_upright_near_the_robot(scene, figures):
    looks = watch("framing", scene, SEEDS)
    near, _ = find_shares(looks)
    is_low = (looks["separation_m"] < NEAR_M) & (looks["posture"] >= POSTURES.index("folded"))
    episodes = count(int(is_low.any(0).sum()), len(SEEDS))
    figures.hold(
        Figure(f"work.framing.{scene}.near", near, least=0.5, most=0.8),
        Figure(f"work.framing.{scene}.episodes_low_near", episodes, most=0.03),
    )
