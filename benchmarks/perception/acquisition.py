"""How soon a search finds people at level `pixels`, and how often somebody who is not there.

    python -m benchmarks.perception.acquisition --scenes site --seeds 200

After each reset the arm rests until the estimator follows the worker. Empty scenes are episodes of
`EMPTY_STEPS` steps, each in a light of its own, the arm at rest or moving at random. Parts of
`BLOCK` resets or episodes are kept: a run that was stopped goes on where it was.
"""

import time
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from benchmarks.common import cell, exactly, share
from hrc_env.cli.progress import show
from hrc_env.core.results import Metric, over
from hrc_env.env import HRCEnv
from hrc_env.experiments.study.cache import PartCache, PartProgress
from hrc_env.experiments.study.report import Metrics, Report, table
from hrc_env.experiments.study.runner import Study, run

BLOCK, EMPTY_STEPS = 10, 25
LOOKS = (1, 6, 25)
"""By these looks a worker should have been found; a reset's own is the first."""
Played = dict[str, list[dict[str, float]]]
REACH = {"still": 0.0, "moving": 1.0}
"""Random actions of the arm in empty scenes."""


@dataclass(frozen=True)
class Arguments:
    """Measure how people are found."""

    out: Path = Path("out/acquisition")
    scenes: tuple[str, ...] = ("lab", "site")
    appearance: str = "varied"
    seeds: int = 200
    """Resets with a worker."""
    first: int = 2000
    """Seed of the first; the others count up."""
    still: int = 80
    """Empty episodes in which the arm rests."""
    moving: int = 20
    """Empty episodes in which it moves."""


def looks_until_found(env: HRCEnv, seed: int) -> dict[str, float]:
    """Looks until the worker is followed, 0 if never, and how long the reset and its look took."""
    rest, began_s = np.zeros(env.action_space.shape or (0,), np.float32), time.perf_counter()
    env.reset(seed=seed)
    found = {"looks": 0.0, "first_s": time.perf_counter() - began_s}
    for look in range(1, LOOKS[-1] + 1):
        if env.simulation.estimate.tracked.all():
            return {**found, "looks": look}
        env.step(rest)
    return found


def phantoms(env: HRCEnv, seed: int, reach: float) -> dict[str, float]:
    """Images of an episode without people, those in which somebody was believed, and steps in which
    somebody was followed; the first episode without people from `seed` on."""
    counts, rng = np.zeros(3), np.random.default_rng(seed)
    env.reset(seed=seed)
    for _ in range(EMPTY_STEPS):
        keypoints, _ = env.simulation.pipeline.last_detections(0)
        assert keypoints is not None
        assert not env.simulation.present.any()
        somebody = keypoints.confidence[0].any((1, 2))
        followed = env.simulation.estimate.tracked.any()
        counts += np.array([len(somebody), somebody.sum(), followed])
        env.step(rng.uniform(-reach, reach, env.simulation.n_actions).astype(np.float32))
    return dict(zip(("images", "believed", "followed"), counts.tolist(), strict=True))


def empty_seeds(scene: str, first: int, n: int) -> list[int]:
    """The first n seeds of whose episodes in a scene for one worker or none none is there."""
    env, found, seed = HRCEnv(scene=scene, n_workers=(0, 1), perception="none"), [], first
    while len(found) < n:
        env.reset(seed=seed)
        found += [] if env.simulation.present.any() else [seed]
        seed += 1
    env.close()
    return found


def _play(arguments: Arguments, parts: PartCache) -> Played:
    played: Played = {}
    seeds = [arguments.first + k for k in range(arguments.seeds)]
    for scene in arguments.scenes:
        empty = empty_seeds(scene, arguments.first, max(arguments.still, arguments.moving))
        jobs: dict[str, tuple[list[int], Any, Any]] = {"found": (seeds, looks_until_found, 1)}
        for name, n in (("still", arguments.still), ("moving", arguments.moving)):
            jobs[name] = (empty[:n], partial(phantoms, reach=REACH[name]), (0, 1))
        for name, (some, what, n_workers) in jobs.items():
            made = {"scene": scene, "n_workers": n_workers, "appearance": arguments.appearance}
            played[f"{scene}.{name}"] = _blocks(f"{scene}.{name}", some, what, made, parts)
    return played


def _blocks(
    name: str, seeds: list[int], what: Any, made: dict[str, Any], parts: PartCache
) -> list[dict[str, float]]:
    """`what` of every seed, block by block, in environments that are `made` so."""

    def make(tick: PartProgress, some: list[int]) -> dict[str, Any]:
        found, env = [], HRCEnv(perception="pixels", **made)
        for seed in some:
            found.append({"seed": seed, **what(env, seed)})
            tick(1 / len(some))
        env.close()
        return {"made": found}

    blocks = (seeds[k : k + BLOCK] for k in range(0, len(seeds), BLOCK))
    done = (parts.part(f"{name}.{some[0]}", partial(make, some=some)) for some in blocks)
    return [one for part in done for one in part["made"]]


def _metrics(arguments: Arguments, played: Played) -> dict[str, Metric]:
    found = {}
    for scene in arguments.scenes:
        looks = [each["looks"] for each in played[f"{scene}.found"]]
        found |= {f"{scene}.found.{n}": share([0 < k <= n for k in looks]) for n in LOOKS}
        found[f"{scene}.first_s"] = over(
            [each["first_s"] for each in played[f"{scene}.found"]], "s"
        )
        for name, what in product(REACH, ("images", "believed", "followed")):
            total = sum(each[what] for each in played[f"{scene}.{name}"])
            found[f"{scene}.{name}.{what}"] = exactly(total, "1")
    return found


def _report(arguments: Arguments, _: Any, metrics: Metrics, __: Path) -> Report:
    rows = [(name, cell(metric, 1, 3, interval=True)) for name, metric in metrics.items()]
    asked = f"Appearance {arguments.appearance}: how soon is who found?"
    return Report("Acquisition", asked, [table(("what", "how much"), rows)])


ACQUISITION = Study(
    name="acquisition",
    modules=("benchmarks.perception.acquisition",),
    settings=lambda a: {"appearance": a.appearance, "first": a.first},
    seeds=lambda a: [a.first, a.first + a.seeds - 1],
    n_parts=lambda a: len(a.scenes) * (a.seeds + a.still + a.moving) / BLOCK,
    play=_play,
    metrics=_metrics,
    report=_report,
)

if __name__ == "__main__":
    given = tyro.cli(Arguments)
    show(lambda out, say: run(ACQUISITION, given, out, say), given.out, "acquisition")
