"""Workers among each other for a long time: python benchmarks/people.py --episodes 1000

Episodes of a minute with three workers in every scene, beside an arm that moves. From the true
bodies it takes how deep they ever are in what stands there and in each other; how long anybody
who wants to be elsewhere, or cannot begin a task, stays within 5 cm; and what is not a number.
"""

import time
from dataclasses import asdict, dataclass, field
from itertools import combinations
from pathlib import Path

import numpy as np
import tyro

from benchmarks.common import exactly, publish
from hrc_env.cli.progress import track
from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats, Points3
from hrc_env.experiments.study.report import Report, table
from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.geometry.shapes import AXES, BOX, CAPSULE, CENTRE, HALF_SIZE, KIND, PLANE
from hrc_env.motion import generator
from hrc_env.motion.schedule import WORK
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
    jobs: str = "framing"
    """What they do: a name of `schedule.WORK`."""
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
    worst: dict[str, float] = field(default_factory=dict)
    """By what was being done: deepest beyond the limit [m]."""

    def deep(self, doing: str, depth_m: float) -> None:
        """Keep what is the worst of its kind."""
        if depth_m > max(DEEPEST_M, self.worst.get(doing, 0.0)):
            self.worst[doing] = depth_m


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
        worst = sorted(notes.worst.items(), key=lambda each: -each[1])
        deep = (f"{doing} {100 * depth:.1f} cm" for doing, depth in worst)
        said.append(f"{name}, deepest beyond 3 cm: {'; '.join(deep) or 'none'}.")
    header = ("scene", "in solids [cm]", "stuck [s]", "in each other [cm]", "NaN", "frame [us]")
    limits = f"In brackets: of {arguments.episodes} episodes beyond 3 cm, 10 s and 3 cm."
    report = Report("People", (__doc__ or "").strip(), [table(header, lines), limits, *said],
                    "the least and the largest of all episodes")  # fmt: skip
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
    people, jobs = generator.PEOPLE[arguments.people], WORK[arguments.jobs]
    config = generator.MotionConfig(people=people, jobs=jobs)
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
        robot = chains.capsules(scene.chain, q)[:, scene.watched, 1]
        began = time.thread_time()
        _, motion = generator.advance(state, rngs, CTRL_DT_S / 5, 5)
        generator.watch(state, robot, motion, CTRL_DT_S)
        spent += time.thread_time() - began
        notes.nans += int(not np.isfinite(motion.position_world).all())
        now = motion.position_world[:, :, 0, :2]
        fine = (np.linalg.norm(now - place, axis=-1) > STILL_M) | (state.workers["going"] == THERE)
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
    feet = np.array(["foot" in part or "toes" in part for part in body.capsule_names])
    share = np.linspace(0.0, 1.0, 5)[:, None]
    points = capsules[..., :1, :] * (1 - share) + capsules[..., 1:, :] * share
    inside = radius - _away(points, solids).min((-1, -2))
    inside[(state.workers["activity"] == CLIMB)[..., None] & feet] = -np.inf  # on what they climb
    depth = inside.max(-1)
    deepest[0] = np.maximum(deepest[0], depth.max(1))
    for b, w in np.argwhere(depth > DEEPEST_M):
        notes.deep(names[state.workers["activity"][b, w]], float(depth[b, w]))
    root = motion.position_world[:, :, 0, :2]
    for i, j in combinations(range(capsules.shape[1]), 2):
        apart = np.linalg.norm(root[:, i] - root[:, j], axis=-1)
        near = np.flatnonzero(apart < 2.6)
        if len(near):
            ends = (capsules[near, i], radius[near, i], capsules[near, j], radius[near, j])
            gap = -least_separation(*ends).distance_m
            k = int(gap.argmax())
            both = " beside ".join(names[state.workers["activity"][near[k], w]] for w in (i, j))
            notes.deep(both, float(gap[k]))
            deepest[1, near] = np.maximum(deepest[1, near], gap)


def _away(points: Points3, solids: Floats) -> Floats:
    """(..., G) signed distances of points (..., 3) from shapes (G, ...) [m]; of planes within
    their edges."""
    axes = solids[:, AXES : AXES + 9].reshape(-1, 3, 3)
    offset = points[..., None, :] - solids[:, CENTRE : CENTRE + 3]
    local = np.einsum("gij,...gj->...gi", axes, offset)
    half, kind, up = solids[:, HALF_SIZE : HALF_SIZE + 3], solids[:, KIND], local[..., 2]
    side, beyond = np.hypot(local[..., 0], local[..., 1]), np.abs(local) - half
    over = np.abs(up) - half[:, 1]  # of what is round: radius, then half its length
    plane = np.where((beyond[..., :2] < 0).all(-1), up, 9.0)
    capsule = np.hypot(side, np.maximum(over, 0.0)) - half[:, 0]
    cylinder = _outside(np.stack([side - half[:, 0], over], -1))
    kinds = [kind == PLANE, kind == BOX, kind == CAPSULE]
    return np.select(kinds, [plane, _outside(beyond), capsule], cylinder)


def _outside(beyond: Floats) -> Floats:
    """Signed distance from how far a point is beyond each pair of faces (..., n)."""
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=-1) + np.minimum(beyond.max(-1), 0.0)


if __name__ == "__main__":
    main(tyro.cli(Arguments))
