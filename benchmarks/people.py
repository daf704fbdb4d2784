"""Workers among each other for a long time: python benchmarks/people.py --episodes 1000

Episodes of a minute with three workers in every scene, beside an arm that moves. From the true
bodies it takes how deep they ever are in what stands there and in each other; how long anybody
who wants to be elsewhere, or cannot begin a task, stays within 5 cm; and what is not a number.
"""

import math
import time
from collections import Counter
from dataclasses import asdict, dataclass, field
from itertools import combinations
from pathlib import Path

import numba
import numpy as np
import tyro

from benchmarks.common import exactly, publish, table
from hrc_env.cli.progress import track
from hrc_env.core.results import Metric
from hrc_env.experiments.study.report import Report
from hrc_env.geometry import chains
from hrc_env.geometry.distances import narrowest_gap
from hrc_env.geometry.shapes import AXES, BOX, CAPSULE, CENTRE, HALF_SIZE, KIND, PLANE, REACH
from hrc_env.motion import generator
from hrc_env.motion.plans import CLIMB
from hrc_env.motion.state import GOING, SPOT_X, SPOT_Y, THERE
from hrc_env.scene.build import Scene, build
from hrc_env.simulation import WATCHED_CAPSULES
from hrc_env.worker.body import pool, stack, worker_truth

DEEPEST_M, STUCK_S = 0.03, 10.0
"""What must not be exceeded."""
STILL_M = 0.05
"""Who stays within so much has not moved [m]."""
CTRL_DT_S, LOOK_EVERY = 0.04, 2
"""Time of a step [s]; bodies are looked at every so many."""
BATCH = 20
"""Episodes that run together."""


@dataclass(frozen=True)
class Arguments:
    """Let workers work among each other."""

    out: Path = Path("out/people")
    """Folder for results.json and a report."""
    episodes: int = 100
    """Episodes in each scene."""
    seconds: float = 60.0
    """Length of an episode [s]."""
    workers: int = 3
    """How many there are."""
    scenes: tuple[str, ...] = ("lab", "site")
    """Where."""
    body: str = "worker_1"
    """Which body they have; "any": each one of their own."""
    people: str = "attentive"
    """How they are: a name of `generator.PEOPLE`."""
    seed: int = 0
    """Of the first episode."""


@dataclass
class Notes:
    """What one scene gave, a number an episode."""

    in_solids_m: list[float] = field(default_factory=list)
    """Deepest [m]; negative: by how much they stayed clear."""
    in_each_other_m: list[float] = field(default_factory=list)
    stuck_s: list[float] = field(default_factory=list)
    """Longest [s]."""
    frame_us: list[float] = field(default_factory=list)
    """A worker's control step [us], planning and watching the robot included; a number a batch."""
    nans: int = 0
    worst: dict[str, tuple[float, str]] = field(default_factory=dict)
    """By what was being done: deepest beyond the limit [m], and of what where."""
    doing: Counter[str] = field(default_factory=Counter)
    """Moments looked at by activity."""

    def deep(self, doing: str, depth_m: float, where: str) -> None:
        """Keep what is the worst of its kind."""
        if depth_m > max(DEEPEST_M, self.worst.get(doing, (0.0, ""))[0]):
            self.worst[doing] = depth_m, where


def main(arguments: Arguments) -> None:
    """Run, print, write."""
    metrics: dict[str, Metric] = {}
    lines, said = [], []
    for name in arguments.scenes:
        notes, scene = Notes(), build(name=name)
        firsts = range(0, arguments.episodes, BATCH)
        for first in track(firsts, f"{name}, {arguments.workers} workers"):
            _play(scene, arguments, first, notes)
        n = len(notes.stuck_s)
        metrics |= {
            f"{name}/in_solids": _extremes(notes.in_solids_m, "m"),
            f"{name}/in_each_other": _extremes(notes.in_each_other_m, "m"),
            f"{name}/stuck": _extremes(notes.stuck_s, "s"),
            f"{name}/nan": exactly(notes.nans, "steps", n),
            f"{name}/frame": exactly(float(np.median(notes.frame_us)), "us", n),
        }
        lines.append([
            name, _beyond(notes.in_solids_m, DEEPEST_M, 100), _beyond(notes.stuck_s, STUCK_S),
            _beyond(notes.in_each_other_m, DEEPEST_M, 100), str(notes.nans),
            f"{metrics[f'{name}/frame'].value:.1f}",
        ])  # fmt: skip
        total = sum(notes.doing.values())
        shares = (f"{doing} {count / total:.1%}" for doing, count in notes.doing.most_common(12))
        worst = sorted(notes.worst.items(), key=lambda each: -each[1][0])
        deep = (f"{100 * depth:.1f} cm: {doing}: {where}" for doing, (depth, where) in worst)
        said.append(f"{name}: {', '.join(shares)}; deepest: {'; '.join(deep) or 'none'}.")
    header = ("scene", "in solids [cm]", "stuck [s]", "in each other [cm]", "NaN", "frame [us]")
    limits = f"In brackets: of {arguments.episodes} episodes beyond 3 cm, 10 s and 3 cm."
    report = Report("People", (__doc__ or "").strip(), [table(header, lines), limits, *said])
    publish(arguments.out, report, asdict(arguments), [arguments.seed], metrics)


def _extremes(values: list[float], unit: str) -> Metric:
    return Metric(max(values), min(values), max(values), unit, len(values))


def _beyond(values: list[float], limit: float, scale: float = 1.0) -> str:
    return f"{scale * max(values):.1f} ({sum(value > limit for value in values)})"


def _play(scene: Scene, arguments: Arguments, first: int, notes: Notes) -> None:
    """A batch of episodes."""
    batch, n_workers = min(BATCH, arguments.episodes - first), arguments.workers
    first += arguments.seed
    body = stack(pool(arguments.body))
    config = generator.MotionConfig(people=generator.people_called(arguments.people))
    state = generator.make_state(batch, n_workers, body, config, scene.grounds)
    rngs = [np.random.default_rng([first + b]) for b in range(batch)]
    generator.reset(state, np.arange(batch), rngs)
    is_floor = (scene.obstacles[:, KIND] == PLANE) & (scene.obstacles[:, AXES + 8] > 0.9)
    deepest = np.full((2, batch), -np.inf)
    place = generator.current(state).position_world[:, :, 0, :2].copy()
    since_s, stuck_s = np.zeros((2, batch, n_workers))
    swing = np.random.default_rng(first).uniform(0.3, 1.2, (batch, 2, scene.chain.n_joints))
    n_steps, spent = round(arguments.seconds / CTRL_DT_S), 0.0
    for step in range(1, n_steps + 1):
        q = scene.home_q + swing[:, 0] * np.sin(swing[:, 1] * step * CTRL_DT_S)
        robot = chains.capsules(scene.chain, q)[:, WATCHED_CAPSULES, 1]
        began = time.thread_time()
        _, motion = generator.advance(state, rngs, CTRL_DT_S / 5, 5)
        generator.watch(state, robot, motion, CTRL_DT_S)
        spent += time.thread_time() - began
        notes.nans += int(not np.isfinite(motion.position_world).all())
        now = motion.position_world[:, :, 0, :2]
        fine = (np.linalg.norm(now - place, axis=-1) > STILL_M) | (
            state.errand[..., GOING] == THERE
        )
        since_s = np.where(fine, 0.0, since_s + CTRL_DT_S)
        place = np.where(fine[..., None], now, place)
        stuck_s = np.maximum(stuck_s, since_s)
        if step % LOOK_EVERY == 0:
            _measure(body, motion, scene.obstacles[~is_floor], state, deepest, notes)
    notes.in_solids_m += deepest[0].tolist()
    notes.in_each_other_m += deepest[1].tolist()
    notes.stuck_s += stuck_s.max(1).tolist()
    notes.frame_us.append(1e6 * spent / (n_steps * batch * n_workers))


def _measure(body, motion, solids, state, deepest, notes) -> None:
    """Note how deep anybody is in what."""
    truth, names = worker_truth(body, motion), generator.activity_names
    capsules, radius = truth.capsules_world, truth.capsule_radius_m
    notes.doing.update(names[doing] for doing in state.activity.ravel().tolist())
    feet = np.array(["foot" in part or "toes" in part for part in body.capsule_names])
    depth, part, solid = _in_solids(capsules, radius, solids, state.activity == CLIMB, feet)
    deepest[0] = np.maximum(deepest[0], depth.max(1))
    for b in np.flatnonzero(depth.max(1) > DEEPEST_M):
        w = int(depth[b].argmax())
        at = np.round(solids[solid[b, w], CENTRE : CENTRE + 3], 2).tolist()
        spot = np.round(state.spots[b, w, [SPOT_X, SPOT_Y]], 2).tolist()
        where = f"{body.capsule_names[part[b, w]]}, place {spot}, solid at {at}"
        notes.deep(names[state.activity[b, w]], float(depth[b, w]), where)
    root = motion.position_world[:, :, 0, :2]
    for i, j in combinations(range(capsules.shape[1]), 2):
        apart = np.linalg.norm(root[:, i] - root[:, j], axis=-1)
        near = np.flatnonzero(apart < 2.6)
        if len(near):
            ends = (capsules[near, i], radius[near, i], capsules[near, j], radius[near, j])
            gap = -narrowest_gap(*ends).distance_m
            k = int(gap.argmax())
            both = " beside ".join(names[state.activity[near[k], w]] for w in (i, j))
            notes.deep(both, float(gap[k]), f"{apart[near[k]]:.2f} m apart")
            deepest[1, near] = np.maximum(deepest[1, near], gap)


@numba.njit(cache=True, error_model="numpy")
def _in_solids(capsules, radius, solids, climbing, feet):
    """How deep each of (B, W) workers is in a solid [m], with which capsule, in which solid.

    Feet (K,) of who is climbing stand on one, as others' on the floor, and are left out.
    """
    n_b, n_w, n_k = capsules.shape[:3]
    depth = np.full((n_b, n_w), -np.inf)
    part, solid = np.zeros((n_b, n_w), np.int64), np.zeros((n_b, n_w), np.int64)
    for b in range(n_b):
        for w in range(n_w):
            for g in range(solids.shape[0]):
                dx = capsules[b, w, 0, 0, 0] - solids[g, CENTRE]
                dy = capsules[b, w, 0, 0, 1] - solids[g, CENTRE + 1]
                if solids[g, KIND] != PLANE and math.hypot(dx, dy) > solids[g, REACH] + 1.6:
                    continue
                for k in range(n_k):
                    if climbing[b, w] and feet[k]:
                        continue
                    for i in range(5):
                        away = _distance(capsules[b, w, k], 0.25 * i, solids[g])
                        inside = radius[b, w, k] - away
                        if inside > depth[b, w]:
                            depth[b, w], part[b, w], solid[b, w] = inside, k, g
    return depth, part, solid


@numba.njit(cache=True, error_model="numpy")
def _distance(ends, u, row):
    """Signed distance of a point of a segment from a shape [m]; of planes within their edges."""
    offset = ends[0] + u * (ends[1] - ends[0]) - row[CENTRE : CENTRE + 3]
    x, y, z = row[AXES : AXES + 9].reshape(3, 3) @ offset
    hx, hy, hz = row[HALF_SIZE], row[HALF_SIZE + 1], row[HALF_SIZE + 2]
    if row[KIND] == PLANE:
        return z if abs(x) < hx and abs(y) < hy else 9.0
    if row[KIND] == BOX:
        ox, oy, oz = abs(x) - hx, abs(y) - hy, abs(z) - hz
        outside = math.sqrt(max(ox, 0.0) ** 2 + max(oy, 0.0) ** 2 + max(oz, 0.0) ** 2)
        return outside + min(max(ox, oy, oz), 0.0)
    side = math.hypot(x, y)
    if row[KIND] == CAPSULE:
        return math.hypot(side, max(abs(z) - hy, 0.0)) - hx
    ox, oz = side - hx, abs(z) - hy
    return math.hypot(max(ox, 0.0), max(oz, 0.0)) + min(max(ox, oz), 0.0)


if __name__ == "__main__":
    main(tyro.cli(Arguments))
