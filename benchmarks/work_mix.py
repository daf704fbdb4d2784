"""What workers do, and in what posture, near the robot and anywhere: python -m benchmarks.work_mix

Whole episodes of the default environment at level `truth`, where `scripted` drives to its goals
whoever is near, for each choice of jobs and each scene. Near: nearer than 0.6 m to the robot,
between true bodies. A posture is the one of `hrc_env.perception.calibration.POSTURES` that a body
counts as most. Intervals are 95 % bootstraps over episodes.
"""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import tyro
from gymnasium.utils import seeding
from numpy.typing import NDArray

from agents.env_info import env_info
from agents.registry import make_agent
from benchmarks.common import publish
from hrc_env.cli.progress import track
from hrc_env.config import settle
from hrc_env.core.results import Metric
from hrc_env.experiments.study.intervals import ratio_over
from hrc_env.experiments.study.report import Column, Report, table_of
from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.motion import generator
from hrc_env.motion.schedule import WORK
from hrc_env.perception.calibration import POSTURES
from hrc_env.perception.outline import posture_of
from hrc_env.simulation import Simulation
from hrc_env.tasks import EPISODE_STEPS
from hrc_env.worker.body import worker_truth

NEAR_M, LOOK_EVERY = 0.6, 5
"""Who is nearer is near [m]: where `scripted_slowed` slows down; steps from look to look."""
LOOKS = np.dtype([("posture", int), ("activity", int), ("separation_m", float)])
"""What is seen of a worker at a look: rows of `POSTURES` and of `generator.activity_names`."""
SCENES = ("lab", "site")


@dataclass(frozen=True)
class Arguments:
    """Watch workers beside a robot."""

    out: Path = Path("out/work_mix")
    """Folder for results.json and a report."""
    episodes: int = 400
    """Of each choice of jobs in each scene."""
    seed: int = 0
    """Of the first episode in the first scene."""


def main(arguments: Arguments) -> None:
    """Run, print, write."""
    metrics: dict[str, Metric] = {}
    kinds = [(jobs, scene) for jobs in WORK for scene in SCENES]
    for jobs, scene in track(kinds, "workers"):
        first = arguments.seed + arguments.episodes * SCENES.index(scene)
        looks = watch(jobs, scene, range(first, first + arguments.episodes))
        for what, metric in shares(looks).items():
            metrics[f"{jobs}.{scene}.{what}"] = metric
    columns = [
        Column(f"{jobs}.{scene}.{where}.{{}}", f"{jobs}, {scene}{beside}", 1, 100.0)
        for jobs, scene in kinds
        for where, beside in (("all", ""), ("near", ", near"))
    ]
    rows = [*POSTURES, "low", *generator.activity_names]
    tables = [table_of("Shares of time [%]", {name: name for name in rows}, columns, metrics)]
    report = Report("What workers do", (__doc__ or "").strip(), tables, "95 % over episodes")
    publish(arguments.out, report, asdict(arguments), [arguments.seed], metrics)


def watch(jobs: str, scene: str, seeds: range) -> NDArray[np.void]:
    """(T, B) looks at the one worker of an episode of each seed."""
    settings = settle(perception="truth", scene=scene, config={"motion": {"jobs": jobs}})
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
    seen["activity"] = generator.activity(part.motion)[:, 0]
    bodies = zip(truth.joints_world[:, 0], truth.velocity_world[:, 0], strict=True)
    seen["posture"] = [np.argmax(posture_of(*body)) for body in bodies]
    return seen


def shares(looks: NDArray[np.void]) -> dict[str, Metric]:
    """By "all" or "near" and what is done or what the posture is: its share of that time. "low":
    folded or kneeling; "time": what is near, of all."""
    found, near = {}, looks["separation_m"] < NEAR_M
    for where, counted in (("all", np.ones_like(near)), ("near", near)):
        found[f"{where}.time"] = _share(counted, np.ones_like(near))
        is_low = looks["posture"] >= POSTURES.index("folded")
        found[f"{where}.low"] = _share(counted & is_low, counted)
        for kind, names in (("posture", POSTURES), ("activity", generator.activity_names)):
            for k, name in enumerate(names):
                found[f"{where}.{name}"] = _share(counted & (looks[kind] == k), counted)
    return found


def _share(some: NDArray[np.bool_], of: NDArray[np.bool_]) -> Metric:
    return ratio_over(some.sum(0), of.sum(0), "share")


if __name__ == "__main__":
    main(tyro.cli(Arguments))
