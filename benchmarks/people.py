"""Workers among each other for a long time: python benchmarks/people.py --episodes 1000

Episodes of a minute with three workers in every scene, beside an arm that moves. From the true
bodies it takes how deep they ever are in what stands there and in each other; how long anybody
who wants to be elsewhere, or cannot begin a task, stays within 5 cm; and what is not a number.
"""

import math
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from hrc_env.cli.progress import track
from hrc_env.core.results import Metric, write_results
from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.geometry.shapes import AXES, BOX, CAPSULE, CENTRE, HALF_SIZE, KIND, PLANE, REACH
from hrc_env.motion import generator
from hrc_env.motion.state import CLIMB, THERE
from hrc_env.scene.build import Scene, build
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

    out: Path = Path("out/people/results.json")
    """Where to write the results."""
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
    """What one scene gave."""

    in_solids_m: list[float]
    """Deepest of each episode [m]; negative: by how much they stayed clear."""
    in_each_other_m: list[float]
    stuck_s: list[float]
    """Longest of each episode [s]."""
    worst: dict[str, tuple[float, str]]
    """By what was being done: deepest beyond the limit [m], and of what where."""
    doing: Counter[str]
    """Moments looked at by activity."""
    nans: int = 0
    frame_us: float = 0.0
    """Time of a worker's control step [us], planning and watching the robot included."""


def main(arguments: Arguments) -> None:
    """Run, print, write."""
    metrics: dict[str, Metric] = {}
    table = Table("scene", "in solids", "in each other", "stuck", "NaN", "frame")
    for name in arguments.scenes:
        notes = episodes(name, arguments)
        for what, values, unit in (
            ("in_solids", notes.in_solids_m, "m"),
            ("in_each_other", notes.in_each_other_m, "m"),
            ("stuck", notes.stuck_s, "s"),
        ):
            metrics[f"{name}/{what}"] = Metric(
                max(values), min(values), max(values), unit, len(values)
            )
        n = len(notes.stuck_s)
        metrics[f"{name}/nan"] = Metric(notes.nans, notes.nans, notes.nans, "steps", n)
        us = notes.frame_us
        metrics[f"{name}/frame"] = Metric(us, us, us, "us", n)
        table.add_row(
            name,
            f"{100 * max(notes.in_solids_m):.1f} cm ({_beyond(notes.in_solids_m, DEEPEST_M)})",
            f"{100 * max(notes.in_each_other_m):.1f} cm "
            f"({_beyond(notes.in_each_other_m, DEEPEST_M)})",
            f"{max(notes.stuck_s):.1f} s ({_beyond(notes.stuck_s, STUCK_S)})",
            str(notes.nans),
            f"{notes.frame_us:.1f} us",
        )
        total = sum(notes.doing.values())
        shares = ", ".join(f"{k} {v / total:.1%}" for k, v in notes.doing.most_common(12))
        Console().print(f"{name}: {shares}", soft_wrap=True)
        for what, (deep, where) in sorted(notes.worst.items(), key=lambda each: -each[1][0]):
            Console().print(f"  {100 * deep:.1f} cm: {what}: {where}", soft_wrap=True)
    Console().print(table)
    Console().print(f"In brackets: of {arguments.episodes} episodes beyond 3 cm, 3 cm and 10 s.")
    config = {name: str(value) for name, value in vars(arguments).items()}
    write_results(arguments.out, config, [arguments.seed], metrics)


def _beyond(values: list[float], limit: float) -> int:
    return sum(value > limit for value in values)


def episodes(name: str, arguments: Arguments) -> Notes:
    """All episodes in one scene."""
    scene, notes = build(name=name), Notes([], [], [], {}, Counter())
    firsts = range(0, arguments.episodes, BATCH)
    times = []
    for first in track(firsts, description=f"{name}, {arguments.workers} workers"):
        batch = min(BATCH, arguments.episodes - first)
        times.append(_some(scene, arguments.seed + first, batch, arguments, notes))
    notes.frame_us = float(np.median(times))
    return notes


def _some(scene: Scene, first: int, batch: int, arguments: Arguments, notes: Notes) -> float:
    """A batch of episodes; microseconds of a worker's control step."""
    body = stack(pool(arguments.body))
    config = generator.MotionConfig(people=generator.PEOPLE[arguments.people])
    state = generator.make_state(batch, arguments.workers, body, config, scene.grounds)
    rngs = [np.random.default_rng([first + b]) for b in range(batch)]
    generator.reset(state, np.arange(batch), rngs)
    solids = scene.obstacles[~_is_floor(scene.obstacles)]
    deepest = np.full((2, batch), -np.inf)
    stuck = _Stuck(generator.current(state).position_world[:, :, 0, :2])
    swing = np.random.default_rng(first).uniform(0.3, 1.2, (batch, 2, scene.chain.n_joints))
    n_steps, spent = round(arguments.seconds / CTRL_DT_S), 0.0
    for step in range(1, n_steps + 1):
        q = scene.home_q + swing[:, 0] * np.sin(swing[:, 1] * step * CTRL_DT_S)
        robot = chains.capsules(scene.chain, q)[:, scene.watched, 1]
        began = time.thread_time()
        _, motion = generator.advance(state, rngs, CTRL_DT_S / 5, 5)
        generator.watch(state, robot, motion, CTRL_DT_S)
        spent += time.thread_time() - began
        notes.nans += int(not np.isfinite(motion.position_world).all())
        stuck.look(motion.position_world[:, :, 0, :2], state.workers["going"] != THERE)
        if step % LOOK_EVERY == 0:
            _measure(scene, body, motion, solids, state, deepest, notes)
    notes.in_solids_m += deepest[0].tolist()
    notes.in_each_other_m += deepest[1].tolist()
    notes.stuck_s += stuck.longest_s.max(1).tolist()
    return 1e6 * spent / (n_steps * batch * arguments.workers)


class _Stuck:
    """How long each of (B, W) workers has wanted to be elsewhere and not moved."""

    def __init__(self, place: np.ndarray) -> None:
        self.place = place.copy()
        self.since_s, self.longest_s = np.zeros(place.shape[:2]), np.zeros(place.shape[:2])

    def look(self, place: np.ndarray, wants: np.ndarray) -> None:
        moved = np.linalg.norm(place - self.place, axis=-1) > STILL_M
        self.since_s = np.where(moved | ~wants, 0.0, self.since_s + CTRL_DT_S)
        self.place = np.where((moved | ~wants)[..., None], place, self.place)
        self.longest_s = np.maximum(self.longest_s, self.since_s)


def _measure(scene, body, motion, solids, state, deepest, notes) -> None:
    """Note how deep anybody is in what."""
    truth = worker_truth(body, motion)
    capsules, radius = truth.capsules_world, truth.capsule_radius_m
    names = generator.activity_names
    for doing in state.workers["activity"].ravel().tolist():
        notes.doing[names[doing]] += 1
    feet = np.array(["foot" in part or "toes" in part for part in body.capsule_names])
    depth, part, solid = _in_solids(
        capsules, radius, solids, state.workers["activity"] == CLIMB, feet
    )
    worst = depth.max(1)
    for b in np.flatnonzero(worst > DEEPEST_M):
        w = int(depth[b].argmax())
        what = names[state.workers["activity"][b, w]]
        if worst[b] > notes.worst.get(what, (0.0, ""))[0]:
            at = np.round(solids[solid[b, w], CENTRE : CENTRE + 3], 2).tolist()
            spot = np.round(state.workers["spot"][b, w, :2], 2).tolist()
            part_name = body.capsule_names[part[b, w]]
            notes.worst[what] = worst[b], f"{part_name}, place {spot}, solid at {at}"
    deepest[0] = np.maximum(deepest[0], worst)
    n_workers = capsules.shape[1]
    root = motion.position_world[:, :, 0, :2]
    for i in range(n_workers):
        for j in range(i):
            near = np.flatnonzero(np.linalg.norm(root[:, i] - root[:, j], axis=-1) < 2.6)
            if not len(near):
                continue
            gap = -least_separation(
                capsules[near, i], radius[near, i], capsules[near, j], radius[near, j]
            ).distance_m
            k = int(gap.argmax())
            both = " beside ".join(names[state.workers["activity"][near[k], w]] for w in (i, j))
            if gap[k] > max(DEEPEST_M, notes.worst.get(both, (0.0, ""))[0]):
                apart = float(np.linalg.norm(root[near[k], i] - root[near[k], j]))
                notes.worst[both] = float(gap[k]), f"{apart:.2f} m apart"
            deepest[1, near] = np.maximum(deepest[1, near], gap)


def _is_floor(solids: np.ndarray) -> np.ndarray:
    return (solids[:, KIND] == PLANE) & (solids[:, AXES + 8] > 0.9)


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
    local = np.zeros(3)
    for axis in range(3):
        for i in range(3):
            p = ends[0, i] + u * (ends[1, i] - ends[0, i]) - row[CENTRE + i]
            local[axis] += p * row[AXES + 3 * axis + i]
    hx, hy, hz = row[HALF_SIZE], row[HALF_SIZE + 1], row[HALF_SIZE + 2]
    if row[KIND] == PLANE:
        return local[2] if abs(local[0]) < hx and abs(local[1]) < hy else 9.0
    if row[KIND] == BOX:
        ox, oy, oz = abs(local[0]) - hx, abs(local[1]) - hy, abs(local[2]) - hz
        outside = math.sqrt(max(ox, 0.0) ** 2 + max(oy, 0.0) ** 2 + max(oz, 0.0) ** 2)
        return outside + min(max(ox, oy, oz), 0.0)
    side = math.hypot(local[0], local[1])
    if row[KIND] == CAPSULE:
        return math.hypot(side, max(abs(local[2]) - hy, 0.0)) - hx
    ox, oz = side - hx, abs(local[2]) - hy
    return math.hypot(max(ox, 0.0), max(oz, 0.0)) + min(max(ox, oz), 0.0)


if __name__ == "__main__":
    main(tyro.cli(Arguments))
