"""A setting's detections and estimator on walks: what is believed beside what is true.

Workers walk once, for all settings, before an arm that rests: nobody reacts to it.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import islice, permutations
from typing import Any, cast

import numpy as np
from scipy.stats import chi2

from hrc_env.config import HRCConfig
from hrc_env.core.batching import rows
from hrc_env.core.machine import n_cores
from hrc_env.core.records import Keypoints, PoseEstimate, WorkerMotion
from hrc_env.core.typing import Bools, Floats, Ints, JointAngles, Points3
from hrc_env.evaluation.counts import ERRORS_M
from hrc_env.experiments.ablations.ablation import Setting
from hrc_env.experiments.ablations.handicaps import handicap, lengths_m
from hrc_env.experiments.cache import PartProgress
from hrc_env.experiments.rigs import N_WARM_UP, Turn
from hrc_env.motion import generator
from hrc_env.perception.emulator import lines_of_sight
from hrc_env.perception.sightlines import SEEN
from hrc_env.pipeline.levels import make_pipeline
from hrc_env.pipeline.sensor_input import Generators, TrueSensorInput
from hrc_env.pipeline.tracking import PoseTracking
from hrc_env.scene.build import Scene, build
from hrc_env.tracking.metrics import make_identities, measure_errors
from hrc_env.worker.body import Body, load_bodies, select_bodies, worker_truth

LEVEL = "keypoints"
BODIES = "any"
"""Every episode gives each worker one of the baked bodies."""
INSIDE_95 = float(chi2.ppf(0.95, 3))
"""Squares of errors in units of their covariance are below this in 95 % of all cases."""
Sums = dict[str, list[Any]]
"""By name, one an episode."""


@dataclass(frozen=True, slots=True)
class Walks:
    """Episodes of the same length, side by side."""

    bodies: Body
    motions: tuple[WorkerMotion, ...]
    """(T) records of arrays (B, W, ...), a control step apart; the first is the beginning."""
    q: JointAngles
    """(B, N) the arm, which rests [rad]."""


@lru_cache(maxsize=1)
def walks_of(scene: str, n_workers: int, seeds: tuple[int, ...], n_steps: int) -> Walks:
    """Episodes of workers at their work, one a seed, each of n_steps."""
    config, bodies = HRCConfig(), load_bodies(select_bodies(BODIES))
    place = build(config.scene, scene, n_workers, bodies.names)
    state = generator.make_state(len(seeds), n_workers, bodies, config.motion, place.grounds)
    rngs = [np.random.default_rng([seed, 0]) for seed in seeds]
    generator.reset(state, np.arange(len(seeds)), rngs)
    motions = [generator.current(state)]
    for _ in range(n_steps - 1):
        _, motion = generator.advance(state, rngs, config.scene.sim_dt, config.n_substeps)
        motions.append(motion)
    spread = np.array(config.start_spread_rad or place.robot.spread_rad)
    turned = [np.random.default_rng([seed, 1]).uniform(-spread, spread) for seed in seeds]
    return Walks(bodies, tuple(motions), place.home_q + np.stack(turned))


def play(setting: Setting, walks: Walks, seeds: Sequence[int], tick: PartProgress) -> Sums:
    """Sums of every episode, in the order of the seeds: of the walks, the detector's errors and the
    estimator. Episode k has turn k modulo the number of turns."""
    jobs, found = _jobs(setting.turns, len(seeds)), Sums()

    def sums_of(job: tuple[Turn, Ints]) -> Sums:
        return _episodes(setting, job[0], walks, seeds, job[1])

    with ThreadPoolExecutor(n_cores()) as threads:
        for (_, ids), sums in zip(jobs, threads.map(sums_of, jobs), strict=True):
            for name, values in sums.items():
                row = found.setdefault(name, [None] * len(seeds))
                for b, value in zip(ids.tolist(), values, strict=True):
                    row[b] = value
            tick(len(ids) / len(seeds))
    return found


def _jobs(turns: Sequence[Turn], n_episodes: int) -> list[tuple[Turn, Ints]]:
    """Turns and the episodes that are played together; nothing depends on how many."""
    jobs = []
    for k, turn in enumerate(turns[:n_episodes]):
        mine = np.arange(k, n_episodes, len(turns))
        n_parts = min(n_cores(), len(mine)) if len(turns) < n_cores() else 1
        jobs += [(turn, part) for part in np.array_split(mine, n_parts)]
    return jobs


def _episodes(setting: Setting, turn: Turn, walks: Walks, seeds: Sequence[int], ids: Ints) -> Sums:
    """Sums of some of the episodes, with these cameras, after the warm-up."""
    errors, inside, lost, seeing, scene = [], [], [], [], scene_of(setting, turn)
    known, identities = [], make_identities(len(ids), setting.n_workers)
    for said, now, _ in islice(watch(setting, turn, walks, seeds, ids), N_WARM_UP, None):
        joints_world = now.truth.joints_world
        order = matched(said.mean_world, said.tracked, joints_world)
        episode = np.arange(len(ids))[:, None]
        off, cov = said.mean_world[episode, order] - joints_world, said.cov_world[episode, order]
        errors.append(np.linalg.norm(off, axis=-1))
        squares = np.einsum("...i,...i->...", off, np.linalg.solve(cov, off[..., None])[..., 0])
        inside.append(squares < INSIDE_95)
        lost.append(~said.tracked[episode, order])
        known.append(measure_errors(said, joints_world, now.present, identities))
        if setting.by_sight:
            seeing.append(n_seeing(now, scene, turn))
    error_m, is_inside, is_lost = (np.stack(each, 1) for each in (errors, inside, lost))
    sums = _sums(error_m, is_inside, np.ones(error_m.shape, bool), "")
    sums["lost"] = is_lost.sum((1, 2)).tolist()
    sums["frames"] = [is_lost[0].size] * len(ids)
    if setting.n_workers > 1:
        sums |= {name: known[-1][name].tolist() for name in ("id_switches", "idf1")}
    if seeing:
        for k in range(len(scene.cameras) + 1):
            sums |= _sums(error_m, is_inside, np.stack(seeing, 1) == k, f"seen_{k}_")
    return sums


def _sums(error_m: Floats, inside: Bools, which: Bools, prefix: str) -> Sums:
    """Of the values (B, T, W, J) that count."""
    axes = tuple(range(1, error_m.ndim))
    return {
        f"{prefix}errors": ERRORS_M.count(error_m, which).tolist(),
        f"{prefix}squares": np.where(which, error_m**2, 0.0).sum(axes).tolist(),
        f"{prefix}inside": (inside & which).sum(axes).tolist(),
        f"{prefix}joints": which.sum(axes).tolist(),
    }


def watch(
    setting: Setting, turn: Turn, walks: Walks, seeds: Sequence[int], ids: Ints
) -> Iterator[tuple[PoseEstimate, TrueSensorInput, Keypoints]]:
    """Frame by frame of some episodes: what is believed, what is true, what was detected."""
    pipeline = pipeline_of(setting, turn, len(ids))
    rngs: list[Generators] = [
        [np.random.default_rng([seeds[b], k]) for b in ids.tolist()] for k in (2, 3)
    ]
    everyone, present = np.arange(len(ids)), np.ones((len(ids), setting.n_workers), bool)
    pipeline.reset(everyone, *rngs)
    lengths = lengths_m(worker_truth(walks.bodies, rows(walks.motions[0], ids)).joints_world)
    for motions in walks.motions:
        motion = rows(motions, ids)
        truth = worker_truth(walks.bodies, motion)
        handicap(pipeline.state, setting.bones, setting.motion, lengths)
        now = TrueSensorInput(everyone, walks.q[ids], motion, truth, present)
        pipeline.sensor.expose(now)
        yield pipeline.perceive(everyone, *rngs), now, pipeline.keypoints
    pipeline.close()


def pipeline_of(setting: Setting, turn: Turn, batch: int) -> PoseTracking:
    """The emulator and the estimator of a setting, for so many episodes."""
    config = HRCConfig(worker=BODIES, tracker=setting.tracker, faults=turn.faults)
    scene = scene_of(setting, turn)
    return cast(PoseTracking, make_pipeline(LEVEL, setting.estimator, scene, batch, config))


def scene_of(setting: Setting, turn: Turn) -> Scene:
    """The scene of a setting with a turn's cameras."""
    config = replace(HRCConfig().scene, cameras=turn.cameras)
    return build(config, setting.scene, setting.n_workers, BODIES)


def matched(mean_world: Points3, tracked: Bools, joints_world: Points3) -> Ints:
    """(B, W) the track of each worker, both (B, W, J, 3) [m]: those that fit best together, no
    track twice; those that are `tracked` (B, W) choose first."""
    n_workers = tracked.shape[1]
    off = np.linalg.norm(mean_world[:, None] - joints_world[:, :, None], axis=-1).mean(-1)
    cost = np.where(tracked[:, None], off, 0.0)  # (B, worker, track)
    orders = np.array(list(permutations(range(n_workers))))
    totals = cost[:, np.arange(n_workers), orders].sum(-1)
    return orders[totals.argmin(1)]


def n_seeing(now: TrueSensorInput, scene: Scene, turn: Turn) -> Ints:
    """(B, W, J) cameras that have a free line of sight to each joint and are not lost for good."""
    surroundings = scene.surroundings(now.qpos, now.motion.held)
    sight, _ = lines_of_sight(now.truth, surroundings, scene.cameras)
    gone = {name for fault in turn.faults if fault.kind == "lost" for name in fault.cameras}
    left = [camera.name not in gone for camera in scene.cameras]
    return (sight[:, left] == SEEN).sum(1)
