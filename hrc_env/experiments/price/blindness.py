"""Does reward on belief teach a robot to blind itself? The question, its trainings, its numbers.

Written down before any of the seeds was drawn:

1. Rewarded by belief, where who is lost counts as far away, a robot ends with more optimism
   (believed less true separation near the worker) than one that is rewarded by the truth, with one
   camera; with four there is no difference beyond 1 cm, as nobody is ever lost.
2. It also ends with more lines of sight cut by its arm, with one camera, and with a greater share
   of steps near the worker without a track; what grows is found, not sought: both stay below twice
   the robot's that is rewarded by the truth.
3. Where who is lost counts as near and the covariance is observed, optimism with one camera is that
   of reward on the truth, within its interval, at no fewer goals.
4. With two cameras all differences lie between those with four and with one.
"""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import partial

import numpy as np

from hrc_env.core.results import Metric
from hrc_env.evaluation.intervals import mean_over
from hrc_env.experiments.cache import PartCache
from hrc_env.experiments.price.trainings import BELIEF, REWARDS, TRUE, Training, learn
from hrc_env.experiments.runner import at_least_one
from hrc_env.experiments.versions import key_of

DEPENDS = ("env", "tracker", "emulator", "motion", "agents")
"""Subsystems that trainings depend on."""
MEASURED = {
    "optimism_m": "m", "lost": "share", "hidden": "share", "unseen": "share", "near": "steps",
    "goals_per_min": "1/min", "contacts": "per episode",
}  # fmt: skip
"""What is measured (`trainings.watch`), and its unit."""
Curves = Mapping[str, list[float]]
Learnt = Mapping[tuple[str, int], list[Curves]]
"""By reward and number of cameras, a seed after the other."""


@dataclass(frozen=True, slots=True)
class TrainingConfig:
    """How much is learnt."""

    rewards: tuple[str, ...] = tuple(REWARDS)
    """What closeness is rewarded by."""
    cameras: tuple[int, ...] = (4, 2, 1)
    """How many there are."""
    n_seeds: int = 5
    """Of each of these with each of those."""
    n_steps: int = 500_000
    """Environment steps of each."""
    n_points: int = 10
    """How often each is watched while it learns."""
    n_watched: int = 32
    """Episodes each time."""

    def __post_init__(self) -> None:
        at_least_one(self, "n_seeds", "n_steps", "n_points", "n_watched")

    @property
    def n_parts(self) -> int:
        """Trainings."""
        return len(self.rewards) * len(self.cameras) * self.n_seeds

    def trainings(self) -> Iterator[Training]:
        """All of them: first those of the first seed."""
        for seed in range(self.n_seeds):
            for n_cameras in self.cameras:
                for reward in self.rewards:
                    yield Training(
                        reward, n_cameras, seed, self.n_steps, self.n_points, self.n_watched
                    )


def config_for(quick: bool) -> TrainingConfig:
    """Quick: every number, from too little to say anything."""
    if quick:
        return TrainingConfig(n_seeds=1, n_steps=16_384, n_points=2, n_watched=4)
    return TrainingConfig()


def play(config: TrainingConfig, cache: PartCache) -> Learnt:
    """Every training, from the cache or anew."""
    found: dict[tuple[str, int], list[Curves]] = {}
    for training in config.trainings():
        key = key_of({**asdict(training), "with": REWARDS[training.reward]}, DEPENDS)
        part = cache.part(f"training.{training.name}", partial(learn, training), key)
        found.setdefault((training.reward, training.n_cameras), []).append(part)
    return found


def metrics_of(learnt: Learnt) -> dict[str, Metric]:
    """By `blind.<reward>_<k>cam.<what>` at the end, `blind.grew.` the same since the start, and
    `blind.difference.<reward>_<k>cam.<what>` less reward on the truth, seed by seed."""
    found = {}
    for (reward, n_cameras), curves in learnt.items():
        key = f"{reward}_{n_cameras}cam"
        truly = learnt.get((TRUE, n_cameras))
        for what, unit in MEASURED.items():
            ends = np.array([[each[what][0], each[what][-1]] for each in curves])
            found[f"blind.{key}.{what}"] = mean_over(ends[:, 1], unit)
            found[f"blind.grew.{key}.{what}"] = mean_over(ends[:, 1] - ends[:, 0], unit)
            if truly is not None and reward != TRUE:
                off = [
                    each[what][-1] - true[what][-1]
                    for each, true in zip(curves, truly, strict=True)
                ]
                found[f"blind.difference.{key}.{what}"] = mean_over(off, unit)
    return found


WORDS = {
    BELIEF: "belief; who is lost counts as far away", TRUE: "truth",
    "careful": "belief; who is lost counts as near, covariance observed",
}  # fmt: skip
"""What closeness is rewarded by, in words."""
