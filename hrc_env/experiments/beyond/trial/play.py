"""A setting's eyes on the walks: what is believed beside what is true, frame by frame."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import chi2

from hrc_env.config import HRCConfig
from hrc_env.core.batching import rows
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Ints, Points3
from hrc_env.experiments.beyond.trial.handicaps import handicap, lengths_m
from hrc_env.experiments.beyond.trial.setting import WARM_UP_S, Setting, Turn
from hrc_env.experiments.beyond.trial.tally import Played, Rows, joined, sums_of
from hrc_env.experiments.beyond.trial.truth import matched, n_seeing
from hrc_env.experiments.beyond.trial.walks import BODIES, Walks
from hrc_env.experiments.study.shelf import Tick
from hrc_env.pipeline.levels import make_pipeline
from hrc_env.pipeline.sensor_input import Generators, TrueSensorInput
from hrc_env.pipeline.tracking import PoseTracking
from hrc_env.scene.build import Scene, build
from hrc_env.worker.body import worker_truth

LEVEL = "keypoints"
DT_S = HRCConfig().ctrl_dt
N_WARM_UP = round(WARM_UP_S / DT_S)
INSIDE_95 = float(chi2.ppf(0.95, 3))
"""Squares of errors in units of their covariance are below this in 95 % of all cases."""
Heard = Callable[[int, PoseEstimate, Points3, TrueSensorInput], None]
"""Told the frame's number, what is believed, the true joints (B, W, J, 3) [m], the scene."""


def play(setting: Setting, walks: Walks, seeds: Sequence[int], n_threads: int, tick: Tick) -> Rows:
    """Sums of every episode, in the order of the seeds.

    Args:
        setting: what is played; episode k has turn k modulo the number of turns.
        walks: of the setting's scene and workers, one a seed.
        seeds: of the detector's errors and the estimator.
        n_threads: nothing depends on it.
        tick: told the share that is done.
    """
    jobs = list(_jobs(len(setting.turns), len(seeds), n_threads))
    found: list[Rows | None] = [None] * len(seeds)

    def job(k: int, ids: Ints) -> tuple[Ints, Rows]:
        return ids, sums_of(_episodes(setting, setting.turns[k], walks, seeds, ids))

    with ThreadPoolExecutor(n_threads) as threads:
        for ids, sums in threads.map(job, *zip(*jobs, strict=True)):
            for row, b in enumerate(ids.tolist()):
                found[b] = {name: values[row : row + 1] for name, values in sums.items()}
            tick(len(ids) / len(seeds))
    return joined([each for each in found if each is not None])


def _jobs(n_turns: int, n_episodes: int, n_threads: int) -> list[tuple[int, Ints]]:
    """Turns and the episodes that are played together."""
    jobs = []
    for turn in range(min(n_turns, n_episodes)):
        mine = np.arange(turn, n_episodes, n_turns)
        n_parts = min(n_threads, len(mine)) if n_turns < n_threads else 1
        jobs += [(turn, part) for part in np.array_split(mine, n_parts)]
    return jobs


def _episodes(
    setting: Setting, turn: Turn, walks: Walks, seeds: Sequence[int], ids: Ints
) -> Played:
    """Some of the episodes, with these cameras."""
    errors, inside, lost, seeing = [], [], [], []
    scene = place_of(setting, turn)

    def heard(frame: int, said: PoseEstimate, joints_world: Points3, now: TrueSensorInput) -> None:
        if frame < N_WARM_UP:
            return
        order = matched(said.mean_world, said.tracked, joints_world)
        mean, cov = (
            np.take_along_axis(each, order.reshape(*order.shape, *[1] * (each.ndim - 2)), 1)
            for each in (said.mean_world, said.cov_world)
        )
        off = mean - joints_world
        errors.append(np.linalg.norm(off, axis=-1))
        squares = np.einsum("...i,...i->...", off, np.linalg.solve(cov, off[..., None])[..., 0])
        inside.append(squares < INSIDE_95)
        lost.append(~np.take_along_axis(said.tracked, order, 1))
        if setting.by_sight:
            seeing.append(n_seeing(now, scene, turn))

    watch(setting, turn, walks, seeds, ids, heard)
    shown = np.stack(seeing, 1) if seeing else np.zeros((len(ids), 0), int)
    return Played(np.stack(errors, 1), np.stack(inside, 1), np.stack(lost, 1), shown)


def watch(
    setting: Setting, turn: Turn, walks: Walks, seeds: Sequence[int], ids: Ints, heard: Heard
) -> list[Keypoints]:
    """Let the eyes of a setting look at some episodes from beginning to end.

    Returns:
        (T) keypoints of every frame.
    """
    pipeline = eyes_of(setting, turn, len(ids))
    rngs: list[Generators] = [
        [np.random.default_rng([seeds[b], k]) for b in ids.tolist()] for k in (2, 3)
    ]
    everyone, present = np.arange(len(ids)), np.ones((len(ids), setting.n_workers), bool)
    pipeline.reset(everyone, *rngs)
    shown, q, lengths = [], walks.q[ids], None
    for frame, motion in enumerate(walks.motions):
        here = rows(motion, ids)
        truth = worker_truth(walks.bodies, here)
        if lengths is None:
            lengths = lengths_m(truth.joints_world)
        handicap(pipeline.state, setting.bones, setting.motion, lengths)
        now = TrueSensorInput(everyone, q, here, truth, present)
        heard(frame, pipeline.perceive(now, *rngs), truth.joints_world, now)
        shown.append(pipeline.keypoints)
    pipeline.close()
    return shown


def eyes_of(setting: Setting, turn: Turn, batch: int) -> PoseTracking:
    """The emulator and the estimator of a setting, for so many episodes."""
    config = HRCConfig(worker=BODIES, tracker=setting.tracker, faults=turn.faults)
    pipeline: Any = make_pipeline(LEVEL, setting.estimator, place_of(setting, turn), batch, config)
    if not isinstance(pipeline, PoseTracking):
        raise ConfigError(f"Level {LEVEL!r} must have cameras and a tracker; it has none.")
    return pipeline


def place_of(setting: Setting, turn: Turn) -> Scene:
    """The scene of a setting with a turn's cameras."""
    config = replace(HRCConfig().scene, cameras=turn.cameras)
    return build(config, setting.scene, setting.n_workers, BODIES)
