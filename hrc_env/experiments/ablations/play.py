"""Episodes of a setting, in which an estimator's tracks of workers are compared with the truth.

The walks of the workers are computed once for all settings. Workers walk beside a stationary arm,
to which they do not react.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import islice, permutations
from typing import Any, NamedTuple, cast

import numpy as np
from scipy.stats import chi2

from hrc_env.config import HRCConfig
from hrc_env.core.batching import rows
from hrc_env.core.machine import n_cores
from hrc_env.core.records import Keypoints, PoseEstimate, WorkerMotion
from hrc_env.core.typing import Bools, Floats, Ints, JointAngles, Points3
from hrc_env.evaluation.counts import ERRORS_M
from hrc_env.experiments.ablations.ablation import Setting
from hrc_env.experiments.ablations.handicaps import compute_lengths_m, handicap
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
"""Perception level of all settings."""
BODIES = "any"
"""Choice of bodies: in every episode, each worker has one of the body models."""
INSIDE_95 = float(chi2.ppf(0.95, 3))
"""Squared Mahalanobis distance at the boundary of the 95 % confidence region of a position."""
Sums = dict[str, list[Any]]
"""Lists of sums by name, one value per episode."""


@dataclass(frozen=True, slots=True)
class Walks:
    """Walks of workers in episodes of the same length, as one batch."""

    bodies: Body
    """All bodies, stacked in one record."""
    motions: tuple[WorkerMotion, ...]
    """Motions at T control steps, including the start; each is a record of arrays (B, W, ...)."""
    q: JointAngles
    """Joint angles (B, N) of the stationary arm [rad]."""


@lru_cache(maxsize=1)
def make_walks(scene: str, n_workers: int, seeds: tuple[int, ...], n_steps: int) -> Walks:
    """Simulate working people; return one walk of `n_steps` control steps per seed as a batch."""
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
    """Play all episodes of a setting and return the sums of each, in the order of the seeds.

    Args:
        setting: the setting.
        walks: walks of the workers.
        seeds: seeds of detector and estimator; episode k uses turn k modulo the number of turns.
        tick: callback that receives the increase of the completed fraction.
    """
    jobs, found = _split_jobs(setting.turns, len(seeds)), Sums()

    def run(job: Job) -> Sums:
        return _play_episodes(setting, job.turn, walks, seeds, job.ids)

    with ThreadPoolExecutor(n_cores()) as threads:
        for job, sums in zip(jobs, threads.map(run, jobs), strict=True):
            for name, values in sums.items():
                row = found.setdefault(name, [None] * len(seeds))
                for b, value in zip(job.ids.tolist(), values, strict=True):
                    row[b] = value
            tick(len(job.ids) / len(seeds))
    return found


class Job(NamedTuple):
    """Episodes that are played as one batch."""

    turn: Turn
    """Cameras of the episodes, and their faults."""
    ids: Ints
    """Indices (B,) of the episodes."""


def _split_jobs(turns: Sequence[Turn], n_episodes: int) -> list[Job]:
    """Return the batches of all turns. Results do not depend on the number of batches."""
    jobs = []
    for k, turn in enumerate(turns[:n_episodes]):
        ids = np.arange(k, n_episodes, len(turns))
        n_parts = min(n_cores(), len(ids)) if len(turns) < n_cores() else 1
        jobs += [Job(turn, part) for part in np.array_split(ids, n_parts)]
    return jobs


def _play_episodes(
    setting: Setting, turn: Turn, walks: Walks, seeds: Sequence[int], ids: Ints
) -> Sums:
    """Play some episodes with the cameras of a turn; return their sums after the warm-up."""
    errors, inside, lost, seeing, scene = [], [], [], [], make_scene(setting, turn)
    known, identities = [], make_identities(len(ids), setting.n_workers)
    for frame in islice(watch(setting, turn, walks, seeds, ids), N_WARM_UP, None):
        estimate, truth = frame.estimate, frame.truth
        joints_world = truth.truth.joints_world
        order = match_tracks(estimate.mean_world, estimate.tracked, joints_world)
        episode = np.arange(len(ids))[:, None]
        off = estimate.mean_world[episode, order] - joints_world
        cov = estimate.cov_world[episode, order]
        errors.append(np.linalg.norm(off, axis=-1))
        squares = np.einsum("...i,...i->...", off, np.linalg.solve(cov, off[..., None])[..., 0])
        inside.append(squares < INSIDE_95)
        lost.append(~estimate.tracked[episode, order])
        known.append(measure_errors(estimate, joints_world, truth.present, identities))
        if setting.by_sight:
            seeing.append(count_seeing_cameras(truth, scene, turn))
    error_m, is_inside, is_lost = (np.stack(rows, 1) for rows in (errors, inside, lost))
    sums = _sum_joints(error_m, is_inside, np.ones(error_m.shape, bool), "")
    sums["lost"] = is_lost.sum((1, 2)).tolist()
    sums["frames"] = [is_lost[0].size] * len(ids)
    if setting.n_workers > 1:
        sums |= {name: known[-1][name].tolist() for name in ("id_switches", "idf1")}
    if seeing:
        for k in range(len(scene.cameras) + 1):
            sums |= _sum_joints(error_m, is_inside, np.stack(seeing, 1) == k, f"seen_{k}_")
    return sums


def _sum_joints(error_m: Floats, inside: Bools, mask: Bools, prefix: str) -> Sums:
    """Return sums over the elements (B, T, W, J) that a mask selects.

    The names of the sums begin with `prefix`.
    """
    axes = tuple(range(1, error_m.ndim))
    return {
        f"{prefix}errors": ERRORS_M.count(error_m, mask).tolist(),
        f"{prefix}squares": np.where(mask, error_m**2, 0.0).sum(axes).tolist(),
        f"{prefix}inside": (inside & mask).sum(axes).tolist(),
        f"{prefix}joints": mask.sum(axes).tolist(),
    }


class WatchedFrame(NamedTuple):
    """Estimate, truth and detections at one frame of some episodes."""

    estimate: PoseEstimate
    """Estimate of the tracker."""
    truth: TrueSensorInput
    """True state."""
    keypoints: Keypoints
    """Keypoints that the cameras detect."""


def watch(
    setting: Setting, turn: Turn, walks: Walks, seeds: Sequence[int], ids: Ints
) -> Iterator[WatchedFrame]:
    """Yield the frames of some episodes of a setting.

    Args:
        setting: the setting.
        turn: cameras and their faults.
        walks: walks of the workers in all episodes.
        seeds: seeds of all episodes.
        ids: indices (B,) of the episodes to play.
    """
    pipeline = make_setting_pipeline(setting, turn, len(ids))
    rngs: list[Generators] = [
        [np.random.default_rng([seeds[b], k]) for b in ids.tolist()] for k in (2, 3)
    ]
    batch, present = np.arange(len(ids)), np.ones((len(ids), setting.n_workers), bool)
    pipeline.reset(batch, *rngs)
    lengths = compute_lengths_m(
        worker_truth(walks.bodies, rows(walks.motions[0], ids)).joints_world
    )
    for motions in walks.motions:
        motion = rows(motions, ids)
        truth = worker_truth(walks.bodies, motion)
        handicap(pipeline.state, setting.bones, setting.motion, lengths)
        sensor_input = TrueSensorInput(batch, walks.q[ids], motion, truth, present)
        pipeline.sensor.expose(sensor_input)
        yield WatchedFrame(pipeline.perceive(batch, *rngs), sensor_input, pipeline.keypoints)
    pipeline.close()


def make_setting_pipeline(setting: Setting, turn: Turn, batch: int) -> PoseTracking:
    """Return the emulator and the estimator of a setting for a batch of episodes."""
    config = HRCConfig(worker=BODIES, tracker=setting.tracker, faults=turn.faults)
    scene = make_scene(setting, turn)
    return cast(PoseTracking, make_pipeline(LEVEL, setting.estimator, scene, batch, config))


def make_scene(setting: Setting, turn: Turn) -> Scene:
    """Return the scene of a setting with the cameras of a turn."""
    config = replace(HRCConfig().scene, cameras=turn.cameras)
    return build(config, setting.scene, setting.n_workers, BODIES)


def match_tracks(mean_world: Points3, tracked: Bools, joints_world: Points3) -> Ints:
    """Return the index (B, W) of the track of each worker, for the least sum of distances.

    Inactive tracks have a cost of 0; they are assigned to the workers that remain.

    Args:
        mean_world: estimated joints of the tracks (B, W, J, 3) [m].
        tracked: mask (B, W) of the active tracks.
        joints_world: true joints of the workers (B, W, J, 3) [m].
    """
    n_workers = tracked.shape[1]
    off = np.linalg.norm(mean_world[:, None] - joints_world[:, :, None], axis=-1).mean(-1)
    cost = np.where(tracked[:, None], off, 0.0)  # (B, worker, track)
    orders = np.array(list(permutations(range(n_workers))))
    totals = cost[:, np.arange(n_workers), orders].sum(-1)
    return orders[totals.argmin(1)]


def count_seeing_cameras(truth: TrueSensorInput, scene: Scene, turn: Turn) -> Ints:
    """Return the number (B, W, J) of working cameras with an unobstructed view of each joint."""
    surroundings = scene.surroundings(truth.qpos, truth.motion.held)
    sight, _ = lines_of_sight(truth.truth, surroundings, scene.cameras)
    gone = {name for fault in turn.faults if fault.kind == "lost" for name in fault.cameras}
    left = [camera.name not in gone for camera in scene.cameras]
    return (sight[:, left] == SEEN).sum(1)
