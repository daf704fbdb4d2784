"""Probes of safety: shields on varied beliefs, and what happens to people along seeded paths.

Robots are made of numbers here, an arm and one on a base that drives; people are the tracker's
walkers, set down about them with errors, ages and speeds of all sizes.
"""

from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.behaviour import doors
from tests.behaviour.probe import Played, Probe, Values, stack
from tests.behaviour.tracker import N_JOINTS, WEIGHTS, walk

Floats = NDArray[np.float64]

STEP_S = 0.04
DH = ((0.1625, 0.0, np.pi / 2), (0.0, -0.425, 0.0), (0.0, -0.3922, 0.0), (0.1333, 0.0, np.pi / 2),
      (0.0997, 0.0, -np.pi / 2), (0.0996, 0.0, 0.0))  # fmt: skip
"""Of an arm of six hinges: offset [m], length [m] and twist [rad]."""


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot as numbers."""

    chain: doors.Chain
    numbers: dict[str, Any]
    n_joints: int


def make_robot(drives: bool) -> Robot:
    """Return an arm of six hinges, or one on a base with two slides and a turn."""
    joints, before = [], np.eye(4)
    n_base = 3 if drives else 0
    if drives:
        along_x, along_y = np.eye(4), np.eye(4)
        along_x[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]  # z of a slide is the world's x
        along_y[:3, :3] = np.linalg.inv(along_x[:3, :3]) @ [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
        upright = np.eye(4)
        upright[:3, :3] = np.linalg.inv(along_x[:3, :3] @ along_y[:3, :3])
        joints += [along_x, along_y, upright]
        before[2, 3] = 0.4
    for offset_m, length_m, twist in DH:
        joints.append(before)
        c, s = np.cos(twist), np.sin(twist)
        before = np.array([[1, 0, 0, length_m], [0, c, -s, 0], [0, s, c, offset_m], [0, 0, 0, 1.0]])
    base = np.eye(4)
    base[:3, 3] = [0.0, 0.0, 0.1 if drives else 0.8]
    ends = [[[0, 0, -0.1], [0, 0, 0.1]], [[0, 0, 0.13], [-0.42, 0, 0.13]],
            [[0, 0, 0.02], [-0.39, 0, 0.02]], [[0, 0, -0.05], [0, 0, 0.05]],
            [[0, 0, -0.05], [0, 0, 0.05]], [[0, 0, 0.0], [0, 0, 0.12]]]  # fmt: skip
    radii, link = [0.09, 0.06, 0.05, 0.05, 0.05, 0.04], n_base + np.arange(6)
    if drives:
        ends, radii = [[[-0.3, 0, 0.2], [0.3, 0, 0.2]], *ends], [0.3, *radii]
        link = np.append(2, link)
    chain = doors.Chain(
        base=base, joints=np.stack(joints), tool=before,
        ranges=np.tile([-6.0, 6.0], (len(joints), 1)),
        speeds=np.full(n_base + 6, 2.0), slides=np.arange(n_base + 6) < (2 if drives else 0),
        capsule_link=link, capsule_ends=np.array(ends, float), capsule_radius_m=np.array(radii),
    )  # fmt: skip
    numbers = {
        "fastest": np.array([0.8, 0.8, 1.0, 1.0, 1.0, 1.2, 1.5, 1.5, 1.5])[3 - n_base :],
        "slew": np.array([2.0, 2.0, 3.0, 4.0, 4.0, 5.0, 8.0, 8.0, 8.0])[3 - n_base :],
        "mass_kg": 160.0 if drives else 14.0, "load_kg": np.array([1.3, 4.0]),
    }  # fmt: skip
    return Robot(chain, numbers, n_base + 6)


@dataclass(frozen=True, slots=True)
class Beliefs:
    """Beliefs, and what is asked for in them."""

    robots: doors.Guarded
    wanted: Floats


@cache
def make_beliefs(kind: str, n: int) -> Beliefs:
    """Return n seeded beliefs: of the "arm", the "base", or an arm with loads at a "handover"."""
    rng = np.random.default_rng([n, len(kind)])
    robot, n_workers = make_robot(kind == "base"), 2
    q = rng.uniform(-2.5, 2.5, (n, robot.n_joints))
    command = rng.uniform(-1.2, 1.2, q.shape) * robot.numbers["fastest"]
    wanted = np.where(rng.random((n, 1)) < 0.1, 0.0, rng.uniform(-1.5, 1.5, q.shape))
    tool = robot.chain.pose(q)["tool"][:, :3, 3]
    is_held = rng.random((n, 2)) < (0.5 if kind == "handover" else 0.0)
    is_held[:, 1] &= ~is_held[:, 0]
    loads = np.where(is_held[:, :, None, None], tool[:, None, None], 9e3) + np.zeros((n, 2, 2, 3))
    loads[:, :, 1] += np.where(is_held[..., None], rng.uniform(-0.2, 0.2, (n, 2, 3)), 0.0)
    now = _people(rng, tool, n_workers, touching=kind == "handover")
    welcome = None
    if kind == "handover":
        welcome = np.zeros((n, n_workers, doors.N_SEGMENTS), bool)
        welcome[: n // 2, 0, [6, 7, -2, -1]] = True
    now |= {"q": q, "qd": command, "command": command, "held": is_held, "load_capsules": loads,
            "load_radius_m": np.array([0.05, 0.09]), "welcome": welcome}  # fmt: skip
    return Beliefs(doors.Guarded(robot.chain, robot.numbers, now), wanted)


@cache
def make_floors(kind: str, n: int) -> Beliefs:
    """Return n seeded beliefs in nobody who is tracked, on floor some of which was seen empty."""
    rng = np.random.default_rng([n, len(kind), 7])
    robot, n_workers = make_robot(kind == "base"), 2
    q = rng.uniform(-2.5, 2.5, (n, robot.n_joints))
    command = rng.uniform(-1.2, 1.2, q.shape) * robot.numbers["fastest"]
    wanted = rng.uniform(-1.5, 1.5, q.shape)
    tool = robot.chain.pose(q)["tool"][:, :3, 3]
    side_m = np.arange(-2.2, 2.21, 0.4)
    floor = np.stack([*np.meshgrid(side_m, side_m), np.zeros((12, 12))], -1).reshape(-1, 3)
    middle_m = rng.uniform(-2.2, 2.2, (n, n_workers, 1, 2)) + tool[:, None, None, :2]
    away_m = np.linalg.norm(floor[:, :2] - middle_m, axis=-1)
    level = np.select([away_m < 0.7, away_m < 1.4], [0, 1], 2) * (rng.random((n, 2, 1)) < 0.9)
    others_m = np.where(rng.random((n, 4, 1)) < 0.15, rng.uniform(-2, 2, (n, 4, 3)), np.nan)
    others_age_s = np.where(np.isnan(others_m[..., 0]), np.inf, rng.uniform(0, 0.5, (n, 4)))
    none, now = np.zeros((n, 2), bool), _people(rng, tool, n_workers, touching=False)
    now |= {"tracked": none, "unknown": rng.random((n, 2)) < 0.9,
            "seen_world": np.full_like(now["seen_world"], np.nan)}  # fmt: skip
    now |= {"q": q, "qd": command, "command": command, "held": none, "welcome": None,
            "load_capsules": np.full((n, 2, 2, 3), 9e3), "load_radius_m": np.array([0.05, 0.09]),
            "floor_m": floor, "piece_m": 0.28, "level": level.astype(int),
            "level_age_s": rng.uniform(0, 0.4, (n, 2)), "others_m": others_m,
            "others_age_s": others_age_s}  # fmt: skip
    return Beliefs(doors.Guarded(robot.chain, robot.numbers, now), wanted)


def _people(
    rng: np.random.Generator, tool_m: Floats, n_workers: int, touching: bool
) -> dict[str, Any]:
    """Return beliefs in people about tools (n, 3): tracked, lost, unknown, unseen for a while."""
    n = len(tool_m)
    poses = np.concatenate([walk(seed, 40) for seed in range(1, 9)])
    joints = poses[rng.integers(0, len(poses), (n, n_workers))]
    joints[..., :2] -= joints[..., :2].mean(-2, keepdims=True)
    far_m, way = (
        rng.uniform(0.1, 1.4, (n, n_workers)) ** 1.2,
        rng.uniform(-np.pi, np.pi, (n, n_workers)),
    )
    joints[..., :2] += (tool_m[:, None, :2] + far_m[..., None] * _toward(way))[:, :, None]
    if touching:  # one hand is near the tool
        near = slice(0, 2 * n // 3)
        hand_m = tool_m[near] + rng.normal(0, 0.12, tool_m[near].shape)
        joints[near, 0] += (hand_m - joints[near, 0, 5])[:, None]
    root = rng.normal(size=(n, n_workers, N_JOINTS, 3, 3))
    scale_m = rng.choice([0.004, 0.01, 0.02, 0.05, 0.12], (n, n_workers, 1, 1, 1),
                         p=[0.3, 0.3, 0.25, 0.1, 0.05])  # fmt: skip
    scale_m = scale_m * rng.choice([0.5, 1.0, 1.5], (n, n_workers, N_JOINTS, 1, 1))
    cov = scale_m**2 * (root @ root.swapaxes(-1, -2) + 0.1 * np.eye(3))
    velocity = rng.normal(0, 0.25, (n, n_workers, 1, 3))
    velocity = velocity + rng.normal(0, 0.15, (n, n_workers, N_JOINTS, 3))
    tracked = rng.random((n, n_workers)) < 0.85
    age_s = rng.choice([0.0, 0.04, 0.12, 0.5], (n, n_workers, N_JOINTS), p=[0.7, 0.1, 0.1, 0.1])
    blind_s = rng.choice([0.0, 0.2, 0.3, 0.8], (n, n_workers), p=[0.8, 0.08, 0.06, 0.06])
    blind_s = np.where(tracked, blind_s, rng.uniform(0.1, 1.2, (n, n_workers)))
    was_seen = (tracked | (rng.random((n, n_workers)) < 0.4))[..., None, None]
    seen = np.where(was_seen, joints + rng.normal(0, 0.1, (n, n_workers, 1, 3)), np.nan)
    unknown = ~tracked & (rng.random((n, n_workers)) < 0.6)
    return {
        "mean_world": joints, "cov_world": cov, "velocity_world": velocity, "age_s": age_s,
        "tracked": tracked, "unknown": unknown, "blind_s": blind_s, "seen_world": seen,
    }  # fmt: skip


def _toward(way: Floats) -> Floats:
    return np.stack([np.cos(way), np.sin(way)], -1)


GROUPS = {"arm": 260, "base": 120, "handover": 120}
"""Kinds of beliefs and how many of each."""
KINDS = ("qp", "ssm", "pfl")
VARIATIONS: tuple[dict[str, Any], ...] = (
    {"margin_m": 0.12}, {"hand_margin_m": 0.02}, {"sigmas": 3.0}, {"least_sigmas_m": 0.0},
    {"predicted_m_s": 0.1}, {"doubtful_m": 0.02}, {"doubtful_sigmas": 1.0}, {"human_m_s": 1.6},
    {"human_m_s": 0.0, "latency_s": 0.1}, {"human_margin_m_s": 0.0}, {"human_s": 0.4},
    {"reaction_s": 0.2}, {"deceleration_m_s2": 1.0}, {"gain_hz": 1.0}, {"retreat_m_s": 0.2},
    {"unseen_s": 0.6}, {"unknown_m_s": 0.0}, {"welcome_m_s": 0.0}, {"still_m_s": 0.1},
)  # fmt: skip
"""Settings that differ from the defaults."""


def guard_default(group: str, kind: str, _: Values) -> Played:
    """Play a shield that comes with the package on a group of beliefs, and the rows it keeps."""
    beliefs = make_beliefs(group, GROUPS[group])
    values = beliefs.robots.guard(beliefs.wanted, STEP_S, kind)
    settings = {"kind": kind, "retreat_m_s": 0.0 if kind == "pfl" else 1.0}
    rows = beliefs.robots.constrain(beliefs.wanted, STEP_S, settings)
    joints = np.cos(np.arange(beliefs.wanted.shape[1]))
    values |= {f"row/{name}": each @ joints if each.ndim == 2 else each
               for name, each in rows.items()}  # fmt: skip
    return Played(_plain(values))


def guard_varied(group: str, _: Values) -> Played:
    """Play shields of other settings on a group of beliefs."""
    beliefs = make_beliefs(group, GROUPS[group])
    joints = np.cos(np.arange(beliefs.wanted.shape[1]))
    values: Values = {}
    for k, settings in enumerate(VARIATIONS):
        kind = (
            KINDS[k % 3] if "welcome_m_s" not in settings and "still_m_s" not in settings else "qp"
        )
        given = _plain(beliefs.robots.guard(beliefs.wanted, STEP_S, {"kind": kind, **settings}))
        rows = beliefs.robots.constrain(beliefs.wanted, STEP_S, {"kind": kind, **settings})
        name = "-".join(f"{key}_{value:g}" for key, value in settings.items())
        values[f"{name}/allowed"] = given["allowed"] @ joints
        values[f"{name}/least_m"] = given["shield/least_m"]
        values[f"{name}/row"] = rows["b"].reshape(-1, 4).sum(1)
    slow = beliefs.robots.guard(beliefs.wanted, 5 * STEP_S, {"kind": "qp"})
    return Played({**values, "slow": slow["allowed"] @ joints})


def guard_floor(group: str, _: Values) -> Played:
    """Play shields near floor on which undetected people may be."""
    beliefs = make_floors(group, 160)
    values = beliefs.robots.measure_floor()
    values["level"] = values["level"][::4]
    joints = np.cos(np.arange(beliefs.wanted.shape[1]))
    for k, settings in enumerate(({}, {"unknown_m_s": 0.0}, {"human_m_s": 1.6}, {"sigmas": 3.0})):
        kind = {"kind": ("qp", "ssm")[k % 2]}
        given = _plain(beliefs.robots.guard(beliefs.wanted, STEP_S, kind | settings))
        rows = beliefs.robots.constrain(beliefs.wanted, STEP_S, kind | settings)
        values |= {f"{k}/allowed": given["allowed"] @ joints, f"{k}/least_m": rows["least_m"],
                   f"{k}/n_rows": rows["n_rows"], f"{k}/b": rows["b"],
                   f"{k}/J": rows["J"] @ joints}  # fmt: skip
    return Played(values)


def _plain(values: dict[str, Any]) -> Values:
    """Return what a shield gives with 9 m where it has no least distance."""
    return {name: np.nan_to_num(np.asarray(each), nan=9.0) for name, each in values.items()}


def enclose(_: Values) -> Played:
    """Play the capsules about walkers, some of whom are small, wide or folded."""
    rng = np.random.default_rng(12)
    people = np.stack([walk(seed, 24, 0.3)[::3] for seed in (1, 2, 3, 4)], 1)
    people[:, 1] *= 0.6
    people[:, 2, :, 1] *= 1.5
    people[:, 3, 1:] = people[:, 3, :1] + 0.2 * (people[:, 3, 1:] - people[:, 3, :1])
    return Played(doors.enclose_bodies(people, rng.normal(0, 0.5, people.shape)))


def measure_beliefs(_: Values) -> Played:
    """Play what beliefs say of distances, and the numbers of shields."""
    values = {}
    for group, n in GROUPS.items():
        for name, each in make_beliefs(group, n).robots.measure().items():
            kept = each if each.ndim == 2 else np.einsum("bwj...,j->bw...", each, WEIGHTS)
            values[f"{group}/{name}"] = kept[::3]
    values |= {f"shield/{name}": each for name, each in doors.default_shields().items()}
    return Played(_plain(values))


def solve(_: Values) -> Played:
    """Play rows that hold, that cannot, with weights of all sizes, in boxes that bind or not."""
    rng = np.random.default_rng(13)
    found = []
    for k in range(120):
        m, n = int(rng.integers(0, 20)), 6
        J, b = rng.normal(size=(m, n)), rng.normal(0.1, 0.4, m)
        weight = rng.choice([30.0, 1e4], m)
        middle, half = rng.normal(0, 0.3, n), rng.uniform(0.05, 1.0, n)
        wanted = rng.normal(0, 1.0, n)
        if k % 10 == 0:
            J[m // 2 :] = J[: m - m // 2]
        found.append(doors.solve_rows(J, b, weight, middle - half, middle + half, wanted))
    return Played({"x": np.array(found)})


def bear(_: Values) -> Played:
    """Play what regions of the body bear, and how far apart people and robots must be."""
    speeds, masses = np.array([0.0, 0.1, 0.25, 0.9]), np.array([0.5, 3.0, 15.0, 200.0])
    regions = np.stack([doors.bear_contact(name, speeds, masses) for name in doors.BODY_REGIONS])
    towards = np.array([-0.5, 0.0, 0.3, 1.2])
    apart = doors.protective_distance(
        towards[:, None], towards, reaction_s=0.1, stopping_s=np.array([0.0, 0.2, 0.4, 0.9]),
        intrusion_m=0.05, human_uncertainty_m=0.1, robot_uncertainty_m=0.02,
    )  # fmt: skip
    walking = doors.protective_distance(towards, reaction_s=0.1, stopping_s=0.3, human_m_s=1.6)
    return Played({
        "regions": regions, "apart_m": apart, "walking_m": walking,
        "masses": doors.effective_mass(masses, np.array([0.0, 1.0, 2.0, 5.0])),
    })  # fmt: skip


def watch(_: Values) -> Played:
    """Play robots and people along seeded paths: touches of every kind, bounces and near misses."""
    rng, batch, n_sub = np.random.default_rng(14), 12, 5
    robot, names = make_robot(False), doors.CAPSULE_NAMES
    watched = doors.Watched(batch, 2, names, robot.chain, robot.numbers, STEP_S)
    n = len(names)
    spots = np.column_stack([np.zeros(n), np.linspace(-1.0, 1.0, n), np.zeros(n)])
    worker_m = rng.uniform(0.04, 0.08, (batch, 2, n))
    place, away = np.zeros(batch), rng.uniform(0.25, 0.5, (batch, 2))
    side = spots[rng.permutation(n)[:batch], 1] + rng.uniform(-0.02, 0.02, batch)
    side[:2], turns_m = spots[0, 1], rng.choice([0.04, 0.13, 0.15, 0.18], (batch, 1))
    moments: list[dict[str, Any]] = []
    for t in range(150):
        if t % 6 == 0:
            speed = rng.choice([-0.9, -0.3, -0.051, -0.02, 0.0, 0.04, 0.06, 0.5, 1.3], batch)
            comes = rng.choice([-1.5, -0.4, 0.0, 0.0, 0.3, 1.0, 2.5], (batch, 2))
        near = away.min(1) - place
        speed = np.where((near > 0.7) & (speed < 0), -speed, speed)
        speed = np.where((near < turns_m[:, 0]) & (speed > 0), -speed, speed)
        comes = np.where((away - place[:, None] > 0.9) & (comes < 0), -comes, comes)
        comes = np.where((away - place[:, None] < turns_m) & (comes > 0), -comes, comes)
        share = np.arange(1, n_sub + 1) / n_sub * STEP_S
        arm = np.zeros((batch, n_sub, 2, 2, 3))
        arm[..., 0] = (place[:, None] + speed[:, None] * share)[..., None, None]
        arm[..., 1] = side[:, None, None, None]
        arm[:, :, 1, 1, 2] = -0.4
        people = np.zeros((batch, n_sub, 2, n, 2, 3)) + spots[:, None]
        people[..., 0] += (away[:, None] - comes[:, None] * share[:, None])[..., None, None]
        people[..., 1, 2] += 0.1
        if t in (60, 61):
            people[3] += 5.0
        qd, held = rng.uniform(-1, 1, (batch, 6)), rng.random((batch, 2)) < 0.3
        found = watched.step(arm, np.array([0.05, 0.07]), people, worker_m, qd, held)
        if t == 100:
            watched.reset(np.array([2, 5]))
        moments.append(_plain(found))
        place, away = place + speed * STEP_S, away - comes * STEP_S
    values = stack(moments)
    values["known/since_s"] = np.minimum(values["known/since_s"], 1e3)
    return Played({name: _thin(name, each) for name, each in values.items()})


def _thin(name: str, values: NDArray[Any]) -> NDArray[Any]:
    """Return numbers of each step as sums over places, and whole numbers as they are."""
    if values.dtype.kind != "f":
        return values
    return np.einsum("tb...,b->t...", values, np.cos(np.arange(values.shape[1])))


def start(_: Values) -> Played:
    """Play starts of robots, drawn again where people are too near."""
    values = {"near": doors.start_near(np.arange(6.0), np.linspace(0.0, 1.0, 6), [1, 2, 3, 4])}
    for people in ("attentive", "headlong"):
        for spread_rad in (0.5, 3.0):
            found = doors.start_apart(40, 7, spread_rad, people)
            values |= {f"{people}_{spread_rad:g}/{key}": each for key, each in found.items()}
    return Played(_plain(values))


def _probes() -> tuple[Probe, ...]:
    guards = [
        Probe(name=f"{kind}_{group}", play=partial(guard_default, group, kind), is_short=True)
        for group in GROUPS
        for kind in KINDS
    ]
    varied = [Probe(name=f"varied_{group}", play=partial(guard_varied, group),
                    is_short=group == "arm") for group in GROUPS]  # fmt: skip
    floors = [
        Probe(name=f"floor_{group}", play=partial(guard_floor, group), is_short=group == "arm")
        for group in ("arm", "base")
    ]
    return (
        *guards,
        *varied,
        *floors,
        Probe(name="beliefs", play=measure_beliefs, is_short=True),
        Probe(name="rows_solved", play=solve, is_short=True),
        Probe(name="regions", play=bear, is_short=True),
        Probe(name="enclosure", play=enclose, is_short=True),
        Probe(name="incidents", play=watch, is_short=True),
        Probe(name="starts", play=start),
    )


PROBES: tuple[Probe, ...] = _probes()
