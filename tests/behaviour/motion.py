"""Workers: everything that they do alone, their bodies, ways over the floor, and whole shifts."""

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.behaviour import doors
from tests.behaviour.probe import Played, Probe, Values, stack

# --- Alone ---------------------------------------------------------------------------------------

EVERY_S, AGAIN_S = 0.11, 0.17
"""Intervals at which a scene is looked at, and when it is played again [s]; no period of a stroke
is a multiple of one."""
EVERY_FEW = 3
"""Points of the body are recorded at so many moments' distance, sums of everything at each."""
POINTS = ("head", "left_hand", "right_hand", "left_toes", "right_toes")


def points(names: tuple[str, ...] = POINTS) -> list[int]:
    """Return the rows of some segments."""
    return [doors.SEGMENT_NAMES.index(name) for name in names]


def play_scenes(scenes: tuple[str, ...], seed: int, every_s: float, inputs: Values) -> Played:
    """Play scenes of the repertoire, each by another body, left-handed ones among them."""
    values: Values = {}
    for k, name in enumerate(scenes):
        body = doors.BODY_NAMES[(seed + k) % len(doors.BODY_NAMES)]
        place = 0.3 * k - 1.0, 0.2 - 0.15 * k, 0.7 + 0.9 * k
        film = doors.perform_scene(name, body, place, k % 3 != 2, 100 * seed + k, every_s)
        values |= _labelled(name, film)
    return Played(values)


def play_heights(inputs: Values) -> Played:
    """Play scenes whose work is at a place, at other heights than usual."""
    values: Values = {}
    scenes = ("climb", "lunge", "receive and hand over", *SCENES["scenes_working"])
    for k, name in enumerate(scenes):
        for n, height_m in enumerate((0.0, 0.55, 1.0, 1.75)):
            body = doors.BODY_NAMES[(k + 3 * n) % len(doors.BODY_NAMES)]
            place = 0.2 * k, -0.3 * n, 0.5 * k - n
            film = doors.perform_scene(name, body, place, n != 2, 10 * k + n, 0.53, height_m)
            values[f"{name} {n}/sums"] = sum_up(film)
    return Played(values)


def play_reaches(inputs: Values) -> Played:
    """Reach and lift at the robot and elsewhere, alone and beside others, with either hand."""
    values: Values = {}
    others = np.array([[0.6, 1.2], [1.6, -0.9]])
    nobody = np.zeros((0, 2))
    cases = ((True, 0.0, nobody), (True, 0.0, others), (False, 0.9, others), (False, 0.3, nobody))
    for k, (is_near, height_m, beside) in enumerate(cases):
        film = doors.perform_reaches(
            doors.BODY_NAMES[2 * k], is_near, height_m, beside, k % 2 == 0, 40 + k, 3, EVERY_S
        )
        values |= _labelled(f"reach {k}", film)
    return Played(values)


def weigh(values: NDArray[Any]) -> NDArray[np.float64]:
    """Return a sum with unlike weights of all numbers of each step (n, ...): (n,), which moves when
    any of them does."""
    flat = np.nan_to_num(np.asarray(values, float).reshape(len(values), -1), nan=3.0, posinf=5.0)
    return flat @ np.cos(1.0 + np.arange(flat.shape[1]) ** 1.3)


def _labelled(name: str, film: Values) -> Values:
    return {
        f"{name}/sums": sum_up(film),
        f"{name}/activity": film["activity"].astype(np.int8),
        f"{name}/position_m": film["position_m"][::EVERY_FEW, points()],
    }


SUMMED = (
    "time_s", "controls", "position_m", "turn", "velocity_m_s", "held", "held_m", "held_turn",
)  # fmt: skip
"""The columns of sums."""


def sum_up(film: Values) -> NDArray[np.float64]:
    """Return sums of all that is known of a film, (T, 8)."""
    return np.stack([weigh(film[name]) for name in SUMMED], axis=1)


# --- Bodies and what they hold -------------------------------------------------------------------


def play_settings(inputs: Values) -> Played:
    """Write down the numbers that describe people, and the jobs that they do."""
    values = {f"settings/{name}": value for name, value in doors.default_settings().items()}
    for work in ("framing", "low_work", "drywall", "handover", "stack"):
        values |= {f"{work}/{name}": value for name, value in doors.list_jobs(work).items()}
    return Played(values)


def play_bodies(inputs: Values) -> Played:
    """Measure every body, and put it into poses drawn at random, folded and stretched ones."""
    values: Values = {}
    rng = np.random.default_rng(5)
    for name in doors.BODY_NAMES:
        values |= {f"{name}/{key}": weigh(v) for key, v in doors.measure_body(name).items()}
        controls = draw_controls(rng, 24)
        posed = doors.pose_body(name, controls)
        values |= {f"{name}/posed/sum of {key}": weigh(value) for key, value in posed.items()}
        values[f"{name}/posed/position_m"] = posed["position_m"][::2, points()]
    n = 2 * len(doors.BODY_NAMES)
    turn = rng.standard_normal((n, 22, 4))
    segments = {
        "position_m": rng.uniform(-2.0, 2.0, (n, 22, 3)),
        "turn": turn / np.linalg.norm(turn, axis=-1, keepdims=True),
        "velocity_m_s": rng.standard_normal((n, 22, 3)),
        "turning_rad_s": rng.standard_normal((n, 22, 3)),
    }
    rows = np.arange(n) % len(doors.BODY_NAMES)
    placed = doors.place_body(doors.BODY_NAMES, rows, segments)
    return Played(values | {f"placed/sum of {key}": weigh(value) for key, value in placed.items()})


LIMITS = (
    (-2.0, 2.0), (-2.0, 2.0), (-3.0, 3.0), (0.45, 1.05), (-0.3, 0.9), (-0.3, 0.3), (-0.5, 0.5),
    (-0.3, 1.4), (-0.5, 0.5), (-0.8, 0.8), (-0.6, 0.8), (-1.0, 1.0), (-0.4, 1.2), (-0.4, 1.2),
    (-0.2, 0.6), (-0.1, 0.5), (-0.7, 0.5), (-0.2, 0.6), (-0.5, 0.1), (-0.7, 0.5),
)  # fmt: skip
"""Between which the first twenty numbers of a pose are drawn: root, pelvis, trunk, head, elbows and
hands that hang."""


def draw_controls(rng: np.random.Generator, n: int) -> NDArray[np.float64]:
    """Return poses (n, 47): roots, trunks, heads, arms and feet of people who do anything."""
    low, high = np.array(LIMITS).T
    q = np.zeros((n, 47))
    q[:, :20] = rng.uniform(low, high, (n, 20))
    root, yaw = q[:, :2], q[:, 2]
    for hand in range(2):
        at = 20 + 3 * hand
        q[:, at : at + 2] = root + rng.uniform(-0.7, 0.7, (n, 2))
        q[:, at + 2] = rng.uniform(0.0, 2.1, n)
    q[:, 26:28] = np.clip(rng.uniform(-0.5, 1.5, (n, 2)), 0.0, 1.0)
    for foot, side in enumerate((0.12, -0.12)):
        at = 28 + 6 * foot
        q[:, at] = root[:, 0] - side * np.sin(yaw) + rng.uniform(-0.35, 0.35, n)
        q[:, at + 1] = root[:, 1] + side * np.cos(yaw) + rng.uniform(-0.35, 0.35, n)
        q[:, at + 2] = rng.uniform(0.05, 0.35, n)
        q[:, at + 3] = yaw + rng.uniform(-0.6, 0.6, n)
        q[:, at + 4] = rng.uniform(-0.4, 1.4, n)
        q[:, at + 5] = rng.uniform(-0.2, 0.6, n)
    return q


def play_props(inputs: Values) -> Played:
    """Place everything that can be held."""
    rng, n = np.random.default_rng(6), len(doors.PROP_KINDS)
    turn = rng.standard_normal((n, 1, 4))
    turn /= np.linalg.norm(turn, axis=-1, keepdims=True)
    shapes = doors.shape_props(np.arange(n)[:, None], rng.uniform(-2.0, 2.0, (n, 1, 3)), turn)
    return Played({"bounds_m": doors.bound_props(), "shapes": shapes})


# --- The floor -----------------------------------------------------------------------------------


def play_floors(n_ways: int, inputs: Values) -> Played:
    """Measure the floors of both scenes and of none, and find ways over them."""
    values: Values = {}
    for place in ("lab", "site", "open"):
        floor = doors.Floor(place)
        rng = np.random.default_rng([7, len(place)])
        (x0, x1), (y0, y1) = floor.x_m, floor.y_m
        spots = rng.uniform([x0 - 0.2, y0 - 0.2], [x1 + 0.2, y1 + 0.2], (80, 2))
        free = spots[floor.measure_slack(spots) > -0.15]
        shares, ways = np.linspace(-0.05, 1.05, 12), []
        for k in range(n_ways):
            start, end = free[rng.integers(len(free), size=2)]
            discs = np.column_stack(
                [rng.uniform([x0, y0], [x1, y1], (k % 4, 2)), rng.uniform(0.2, 0.8, k % 4)]
            )
            ways.append(floor.find_way(start, end, float(rng.uniform(-1, 1)), discs, shares))
        found = {**stack(ways), "slack_m": floor.measure_slack(spots)}
        found |= floor.describe() | {f"load/{k}": v for k, v in floor.lay_loads(3).items()}
        values |= {f"{place}/{key}": value for key, value in found.items() if value.size}
    return Played(values)


# --- Clips ---------------------------------------------------------------------------------------


def stride(
    rng: np.random.Generator, n: int, fps: float, speed_m_s: float, airborne: float = 0.0
) -> dict[str, Any]:
    """Return control vectors (n, 47) of somebody who goes along a curve, now and then stands, and
    which feet stand; `airborne` is the share of steps in which both feet are off the floor."""
    size_m = doors.measure_body(doors.BODY_NAMES[rng.integers(len(doors.BODY_NAMES))])["sizes_m"][0]
    t = np.arange(n) / fps
    goes = np.clip(1.5 * np.sin(0.8 * t + rng.uniform(0.0, 6.0)) + 0.8, 0.0, 1.0)
    yaw = rng.uniform(-3.0, 3.0) + np.cumsum(rng.uniform(-0.7, 0.7) * goes) / fps
    yaw += 0.4 * np.sin(0.5 * t)
    q = draw_controls(rng, 1)[0] * np.ones((n, 1))
    q[:, 20:28] = q[:, 40:] = 0.0
    q[:, 7:20] += 0.1 * np.sin(rng.uniform(0.5, 2.0, 13) * t[:, None] + rng.uniform(0.0, 6.0, 13))
    q[:, 0] = rng.uniform(-2.0, 2.0) + np.cumsum(speed_m_s * goes * np.cos(yaw)) / fps
    q[:, 1] = rng.uniform(-2.0, 2.0) + np.cumsum(speed_m_s * goes * np.sin(yaw)) / fps
    q[:, 2], q[:, 3] = yaw, 0.9 + 0.03 * np.sin(3.0 * t)
    steps = np.cumsum(5.0 * goes) / fps + rng.uniform(0.0, 6.0)
    contacts = np.zeros((n, 2), bool)
    for foot, side in enumerate((0.11, -0.11)):
        at, lifted = 28 + 6 * foot, goes * np.sin(steps + np.pi * foot) + airborne
        q[:, at] = q[:, 0] - side * np.sin(yaw) + 0.2 * goes * np.cos(yaw) * np.cos(steps)
        q[:, at + 1] = q[:, 1] + side * np.cos(yaw) + 0.2 * goes * np.sin(yaw) * np.cos(steps)
        q[:, at + 2] = size_m[5] + 0.16 * np.maximum(lifted, 0.0)
        q[:, at + 3] = yaw + 0.1 * np.sin(t + foot)
        q[:, at + 4] = 0.3 * np.maximum(lifted, 0.0) + rng.normal(0.0, 0.02, n)
        q[:, at + 5] = 0.1 * np.sin(2.0 * t + foot)
        contacts[:, foot] = lifted < 0.1
    return {"controls": q, "contacts": contacts, "size_m": size_m, "fps": fps, "source": "probe"}


FILMS: tuple[tuple[int, float, float, float], ...] = (
    (140, 20.0, 0.6, 0.0), (90, 30.0, 1.1, 0.0), (700, 15.0, 0.3, 0.0), (1500, 30.0, 0.25, 0.1),
    (60, 10.0, 1.4, 0.0), (420, 12.0, 0.9, 0.15), (16, 25.0, 0.7, 0.0), (12, 25.0, 0.4, 0.0),
    (11, 25.0, 0.2, -0.2), (500, 25.0, 2.4, 0.0), (200, 25.0, 0.6, 1.0), (260, 8.0, 0.1, 0.3),
    (900, 40.0, 0.05, 0.05), (640, 16.0, 0.5, 0.2),
)  # fmt: skip
"""Frames, frames a second, speed [m/s] and how much of the time is spent in the air."""


def dash(rng: np.random.Generator, n: int, fps: float, first: int, last: int) -> dict[str, Any]:
    """Return a film as `stride` makes it, of somebody who dashes ahead between two frames."""
    film = stride(rng, n, fps, 0.3)
    q, ahead = film["controls"], np.zeros(n)
    ahead[first:last] = 13.0 / fps
    way_m = np.cumsum(ahead[:, None] * np.stack([np.cos(q[:, 2]), np.sin(q[:, 2])], -1), axis=0)
    for at in (0, 28, 34):
        q[:, at : at + 2] += way_m
    return film


DASHES = ((80, 20.0, 0, 21), (90, 25.0, 0, 40), (120, 20.0, 40, 60), (70, 15.0, 45, 70),
          (100, 25.0, 3, 30), (60, 12.0, 5, 14), (30, 20.0, 0, 3), (30, 20.0, 0, 3),
          (40, 12.0, 0, 2), (40, 12.0, 0, 2), (40, 12.0, 0, 2), (40, 12.0, 0, 2))  # fmt: skip
"""Frames, frames a second, first and last frame of a dash."""


def film_strides(seed: int, films: tuple[tuple[int, float, float, float], ...] = FILMS) -> Any:
    """Return a clip of each of some films."""
    rng = np.random.default_rng([31, seed])
    return [doors.make_clip_of(**stride(rng, *film)) for film in films]


def play_pieces(inputs: Values) -> Played:
    """Cut clips of all lengths, ways and rates into pieces, for several bodies and places."""
    values: Values = {}
    for seed, place in enumerate(("lab", "site", "open")):
        clips = film_strides(seed)
        groups = [[clip] for clip in clips] + [clips[:4], clips[1::-1]]
        for k, group in enumerate(groups):
            names = doors.BODY_NAMES[k % 4 :: 3]
            cut = doors.cut_clips(group, names, place)
            label = f"{place}/{k}"
            values[f"{label}/is refused"] = np.array([cut is None])
            if cut is None:
                continue
            values[f"{label}/seconds"] = np.array([doors.time_pieces(group, names, place)])
            values |= {f"{label}/{name}": cut[name] for name in ("row", "count", "fps")}
            sums = [weigh(cut[name][None])[0] / cut[name].size for name in ("frames", "starts")]
            values[f"{label}/sums"] = np.array([*sums, len(cut["starts"])])
    return Played(values)


def play_dashes(inputs: Values) -> Played:
    """Cut clips in which there is room for parts only."""
    values: Values = {}
    for place in ("lab", "site", "open"):
        for k, film in enumerate(DASHES):
            clip = doors.make_clip_of(**dash(np.random.default_rng([33, k]), *film))
            cut = doors.cut_clips([clip], doors.BODY_NAMES[k % 3 :: 4], place)
            found = np.zeros(0) if cut is None else cut["frames"].sum(1)
            values[f"{place}/{k}/frames"] = found
            values[f"{place}/{k}/count"] = np.zeros(0) if cut is None else cut["count"]
            values[f"{place}/{k}/starts"] = np.zeros(0) if cut is None else weigh(cut["starts"])
    return Played({name: value for name, value in values.items() if value.size})


def play_clip_files(inputs: Values) -> Played:
    """Make clips of numbers at the edge of what is believed, and read files, also spoilt ones."""
    rng = np.random.default_rng(32)
    film = stride(rng, 40, 25.0, 0.8)
    values: Values = {"believed": np.array([_is_believed(film, k) for k in range(N_TRIALS)])}
    clips = [doors.make_clip_of(**film), *film_strides(3, ((30, 20.0, 0.5, 0.0),) * 2)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "clip.npz"
        read = [doors.read_clip(path)]
        for k, clip in enumerate(clips):
            doors.write_clip(clip, path)
            again = doors.read_clip(path)
            read.append(again)
            listed = {
                name: v if len(v) == 1 else weigh(v) for name, v in doors.list_clip(again).items()
            }
            values |= {f"{k}/{name}": value for name, value in listed.items()}
        doors.write_clip(clips[0], path)
        whole, stored = path.read_bytes(), _load(path)
        for content in (whole[:-30], whole[: len(whole) // 2], b"", b"no clip at all"):
            path.write_bytes(content)
            read.append(doors.read_clip(path))
        for spoil in SPOILT:
            np.savez(path, **spoil(dict(stored)))
            read.append(doors.read_clip(path))
    values["read"] = np.array([clip is not None for clip in read])
    values["is_same"] = np.array([[a == b for b in (*clips, film)] for a in (*read, *clips)])
    return Played(values)


def _load(path: Path) -> dict[str, Any]:
    with np.load(path) as file:
        return {name: file[name] for name in file.files}


Stored = dict[str, Any]
SPOILT: tuple[Callable[[Stored], Stored], ...] = (
    lambda stored: stored,
    lambda stored: stored | {"more": np.zeros(3)},
    lambda stored: stored | {"version": np.array(0)},
    lambda stored: stored | {"version": np.array(2)},
    lambda stored: stored | {"controls": stored["controls"][:, 1:]},
    lambda stored: stored | {"controls": stored["controls"][None]},
    lambda stored: stored | {"contacts": stored["contacts"][1:]},
    lambda stored: stored | {"contacts": stored["contacts"] * 2},
    lambda stored: stored | {"size": stored["size"][1:]},
    lambda stored: stored | {"size": stored["size"].astype(np.float32)},
    lambda stored: stored | {"fps": np.array(3.0)},
    lambda stored: stored | {"source": np.array("another")},
    *(lambda stored, name=name: {n: v for n, v in stored.items() if n != name}
      for name in ("version", "controls", "contacts", "size", "fps", "source")),
)  # fmt: skip
"""What is changed in a file that is a clip."""
N_TRIALS = 36
RATES_HZ = (2.0, 4.9, 5.0, 5.5, 60.0, 600.0, 999.0, 1000.0, 1001.0, 3000.0, -25.0, np.nan)
"""Some that are believed of a recording, and some that are not."""


def _is_believed(film: dict[str, Any], k: int) -> bool:
    """Return whether a clip is made of a film of which one number is another."""
    made = {name: np.copy(value) if name[:2] != "fp" else value for name, value in film.items()}
    q, size_m = made["controls"], made["size_m"]
    if k < 12:
        made["fps"] = RATES_HZ[k]
        q[:, :2] = 0.0
    elif k < 20:
        q[:, :2] = (0.0, 60.0, 150.0, 199.9, 200.1, 260.0, -150.0, -260.0)[k - 12]
        q[:, k % 2] = 0.0
    elif k < 26:
        q[:, :2] = 0.0
        q[20:, :2] += np.array((3.0, 4.0)) * (0.05, 0.09, 0.119, 0.121, 0.2, -0.121)[k - 20]
    elif k < 30:
        (q[5] if k < 28 else size_m)[k % 3 + 1] = (np.nan, np.inf)[k % 2]
    elif k < 33:
        size_m[2] = (0.0, -0.1, 1e-3)[k - 30]
    else:
        n = (1, 2, 3)[k - 33]
        made |= {"controls": q[:n], "contacts": made["contacts"][:n]}
    made["source"] = "probe"
    return doors.make_clip_of(**made) is not None


# --- Shifts --------------------------------------------------------------------------------------

LOOK_STEPS, STEP_S = 2, 0.04
"""Workers look at the robot after so many steps of this length [s]."""
Robot = Callable[[tuple[float, float], float, int], list[list[float]]]
"""Two points of a robot at a place, at a time [s], in an environment [m]."""


def swing_arm(robot_m: tuple[float, float], time_s: float, b: int) -> list[list[float]]:
    """Return elbow and tool of an arm that sweeps through the space in front of it, now slowly,
    now fast."""
    t, (x, y) = time_s + 5.0 * b, robot_m
    quick = 1.0 if (t % 20.0) < 12.0 else 2.6
    angle = 1.25 * np.sin(0.6 * quick * t)
    reach = 0.78 + 0.35 * np.sin(0.37 * quick * t)
    return [
        [x + 0.4 * np.cos(angle), y + 0.4 * np.sin(angle), 1.2 + 0.1 * np.sin(t)],
        [x + reach * np.cos(angle), y + reach * np.sin(angle), 1.05 + 0.35 * np.sin(0.9 * t)],
    ]


def drive_about(robot_m: tuple[float, float], time_s: float, b: int) -> list[list[float]]:
    """Return front and back of a machine that drives in loops over the floor."""
    t, (x, y) = time_s + 7.0 * b, robot_m
    angle = 0.25 * t + 1.5 * np.sin(0.17 * t)
    middle = x + 1.7 + 1.2 * np.cos(angle), y + 1.5 * np.sin(angle)
    ahead = -0.3 * np.sin(angle), 0.3 * np.cos(angle)
    return [[middle[0] + s * ahead[0], middle[1] + s * ahead[1], 0.5] for s in (1.0, -1.0)]


def sweep_pile(robot_m: tuple[float, float], time_s: float, b: int) -> list[list[float]]:
    """Return elbow and tool of an arm that comes near to a pile of loads, and goes away again."""
    t, (x, y) = time_s + 3.0 * b, robot_m
    reach = 2.05 - 0.5 * (1.0 + np.sin(0.9 * t))
    return [
        [x + 0.5 * reach, y + 0.2, 1.1],
        [x + reach, y + 0.3 + 0.5 * np.sin(0.37 * t), 0.7 + 0.2 * np.sin(0.5 * t)],
    ]


@dataclass(frozen=True)
class Shift:
    """Some workers, where they work and for how long."""

    place: str
    people: str | Mapping[str, Any]
    seed: int
    lasts_s: float = 60.0
    n_environments: int = 2
    n_workers: int = 2
    bodies: tuple[str, ...] = doors.BODY_NAMES
    robot: Robot = swing_arm
    every_s: float = 1.6
    """Interval at which they are recorded [s]."""
    has_cues: bool = False
    """Whether a task tells them how far it has come."""
    n_clips: int = 0
    """How many of the films they play."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Further arguments of `doors.Crew`."""


def play_shift(shift: Shift, inputs: Values) -> Played:
    """Let workers go about their work while a robot moves."""
    clips = film_strides(shift.seed, PLAYED[: shift.n_clips])
    crew = doors.Crew(
        shift.place, shift.n_environments, shift.n_workers, shift.bodies, shift.people, shift.seed,
        clips=tuple(clips), **shift.options,
    )  # fmt: skip
    since_s = LOOK_STEPS * STEP_S
    every = max(1, round(shift.every_s / since_s))
    moments, sums = [], []
    for k in range(round(shift.lasts_s / since_s)):
        crew.go_on(STEP_S, LOOK_STEPS)
        at = [shift.robot(crew.robot_m, k * since_s, b) for b in range(shift.n_environments)]
        cue = _cue(k * since_s, np.array(at)) if shift.has_cues else ()
        crew.look_at_robot(np.array(at), since_s, *cue)
        moved = crew.move()
        now = {**crew.see(), **crew.list_deeds(), **moved}
        sums.append({f"sum of {name}": weigh(value) for name, value in now.items()})
        if k % every == every - 1:
            moments.append(_moment(crew, moved))
    values: Values = {
        name: value.reshape(-1, every, *value.shape[1:]).sum(1)
        for name, value in stack(sums[: every * len(moments)]).items()
    }
    return Played(values | stack(moments))


def _cue(time_s: float, robot_m: NDArray[np.float64]) -> tuple[Any, ...]:
    """Return how far a task has come, and where its thing is offered."""
    environments = range(len(robot_m))
    periods_s = [0.6 + 0.3 * b if time_s % 30.0 < 20.0 else 5.0 for b in environments]
    stage = np.array([int(time_s / period_s) % 3 for period_s in periods_s])
    offered = np.array([[1.16, 0.06, 1.12], [1.1, -0.12, 1.2]])[: len(robot_m)]
    return stage, offered + 0.04 * np.sin(time_s)


def _moment(crew: doors.Crew, moved: Values) -> Values:
    at = points(("pelvis", "left_hand", "right_hand"))
    return {
        "activity": moved["activity"], "held": moved["held"], "doing": moved["plan/doing"],
        "position_m": moved["position_m"][:, :, at], "meets": crew.meet(),
    }  # fmt: skip


EVENTFUL: dict[str, Any] = {
    "pause_probability": 0.5, "step_back_probability": 0.4, "sudden_probability": 0.3,
    "lunge_probability": 0.3, "stumble_probability": 0.3, "careless_probability": 0.2,
    "fall_probability": 0.2, "run_probability": 0.3, "stay_down_probability": 0.3, "tempo": 0.4,
    "calm_s": 1.0, "delay_s": (0.2, 0.4), "pause_s": (0.3, 0.9),
}  # fmt: skip
"""People to whom everything happens."""
BUSY: dict[str, Any] = {"near_probability": 0.1, "dwell_s": (2.0, 6.0), "away_pause_s": (0.3, 1.0)}
"""Workers who go about much."""
NEAR: dict[str, Any] = {"near_probability": 1.0, "dwell_s": (4.0, 9.0)}
TASK = (("task", 1.3, 0.1, np.pi + 0.1, 1.2, ()),)
STACKED = (
    ("task", 1.3, 0.3, np.pi - 0.2, 0.55, ("stud",) * 4),
    ("bench", 1.9, -1.3, -1.2, 0.85, ()),
)
SHIFTS: dict[str, Shift] = {
    "shift_lab_attentive": Shift("lab", "attentive", 11, 90.0),
    "shift_lab_unaware": Shift("lab", "unaware", 12, n_workers=3, options={"settings": BUSY}),
    "shift_site_hurried": Shift("site", "hurried", 13, 80.0, n_workers=3),
    "shift_site_headlong": Shift("site", "headlong", 14, 80.0, options={"settings": BUSY}),
    "shift_site_carrying": Shift(
        "site", "attentive", 15, 120.0, n_workers=4, options={"settings": BUSY, "fewest": 2}
    ),
    "shift_eventful": Shift("open", EVENTFUL, 16, 60.0, options={"settings": NEAR}),
    "shift_eventful_lab": Shift("lab", EVENTFUL, 17, 80.0, options={"settings": BUSY}),
    "shift_low": Shift("lab", "attentive", 18, 60.0, options={"work": "low_work"}),
    "shift_machine": Shift(
        "site", EVENTFUL, 19, 60.0, robot=drive_about,
        options={"settings": BUSY, "girth_m": 0.45},
    ),
    "shift_crowded": Shift(
        "open", "attentive", 23, 16.0, n_workers=7, every_s=2.0,
        options={"settings": {"near_probability": 0.5}},
    ),
    "shift_drywall": Shift(
        "open", "attentive", 20, 90.0, n_workers=1, has_cues=True,
        options={"work": "drywall", "more_places": TASK, "settings": NEAR},
    ),
    "shift_handover": Shift(
        "open", "attentive", 21, 90.0, n_workers=1, has_cues=True,
        options={"work": "handover", "more_places": TASK, "settings": NEAR},
    ),
    "shift_stack": Shift(
        "open", "attentive", 22, 60.0, n_workers=1,
        options={"work": "stack", "more_places": STACKED, "settings": BUSY},
    ),
}  # fmt: skip

PLAYED = (
    (140, 20.0, 0.35, 0.0),
    (300, 12.0, 0.1, 0.1),
    (90, 30.0, 0.5, 0.0),
    (200, 25.0, 0.2, 0.0),
)
"""Films, as in `FILMS`, for which there is room among workers."""
BACKING: dict[str, Any] = {
    **EVENTFUL, "step_back_probability": 0.9, "pause_probability": 0.05, "notice_m": 3.0,
    "calm_s": 0.5, "detour_m": 0.5,
}  # fmt: skip
"""People who step back, so that they must go to their place again."""
THRONGED: dict[str, Any] = {"near_probability": 0.6, "dwell_s": (4.0, 9.0)}


UNMOVED: dict[str, Any] = {"pause_probability": 0.05, "step_back_probability": 0.0, "notice_m": 0.5}
"""People who react to little."""


def _throng(
    place: str, seed: int, n_workers: int, people: Mapping[str, Any] = BACKING, **changes: Any
) -> Shift:
    """Return a shift in which workers are in each other's way, and wait."""
    settings = THRONGED | changes.pop("settings", {})
    options = {"settings": settings, "fewest": n_workers}
    shift = {"lasts_s": 40.0, "every_s": 3.2, "options": options} | changes
    return Shift(place, people, seed, n_workers=n_workers, **shift)


ALONE: dict[str, Any] = {"near_probability": 1.0}
SHIFTS |= {
    "shift_waiting": _throng("open", 32, 8),
    "shift_waiting_lab": _throng("lab", 32, 4, settings=ALONE),
    "shift_waiting_lab_again": _throng("lab", 31, 6),
    "shift_waiting_site": _throng("site", 32, 6, settings=ALONE),
    "shift_waiting_site_again": _throng("site", 31, 8),
    "shift_hampered": _throng("site", 32, 8, EVENTFUL),
    "shift_pile_reached": Shift(
        "open", UNMOVED, 36, 80.0, n_workers=1, robot=sweep_pile,
        options={"work": "stack", "more_places": STACKED, "settings": BUSY},
    ),
    "shift_pile_shared": Shift(
        "open", UNMOVED | {"notice_m": 0.8}, 37, 60.0, n_workers=2, robot=sweep_pile,
        options={"work": "stack", "more_places": STACKED, "settings": BUSY},
    ),
    "shift_clips_lab": _throng(
        "lab", 33, 3, n_clips=4, lasts_s=60.0, settings={"motions_probability": 0.7}
    ),
    "shift_clips_site": _throng(
        "site", 34, 4, EVENTFUL, n_clips=3, lasts_s=60.0, settings={"motions_probability": 0.9}
    ),
    "shift_clips_open": _throng(
        "open", 35, 2, EVENTFUL, n_clips=2, lasts_s=60.0, settings={"motions_probability": 0.5}
    ),
}  # fmt: skip

SCENES: dict[str, tuple[str, ...]] = {
    "scenes_standing": ("stand", "look round", "point", "turn", "step back", "lunge", "stumble"),
    "scenes_walking": tuple(n for n in doors.SCENE_NAMES if n.startswith(("walk", "run"))),
    "scenes_falling": ("fall",),
    "scenes_pushing": ("cart", "wheelbarrow", "climb"),
    "scenes_loads": (
        "box from the floor to a table", "board in both hands", "board on the shoulder",
        "receive and hand over", "take what is brought",
    ),
    "scenes_working": (
        "squat", "kneel", "hammer lightly", "hammer on a table", "hammer at a wall",
        "hammer on the floor", "drill", "drill overhead", "saw", "measure",
        "screw below each other",
    ),
}  # fmt: skip
"""Scenes that are played by one probe each; what is in none of them is played by "scenes_rest"."""
REST = tuple(n for n in doors.SCENE_NAMES if not any(n in group for group in SCENES.values()))


def _probes() -> tuple[Probe, ...]:
    plain = (
        Probe(name="settings", play=play_settings, is_short=True),
        Probe(name="bodies", play=play_bodies, is_short=True),
        Probe(name="props", play=play_props, is_short=True),
        Probe(name="floors", play=partial(play_floors, 24), is_short=True),
        Probe(name="heights", play=play_heights, is_short=True),
        Probe(name="reaches", play=play_reaches, is_short=True),
        Probe(name="clip_pieces", play=play_pieces, is_short=True),
        Probe(name="clip_dashes", play=play_dashes, is_short=True),
        Probe(name="clip_files", play=play_clip_files, is_short=True),
    )
    scenes = [(n, partial(play_scenes, s, 1, EVERY_S)) for n, s in SCENES.items()]
    scenes += [(f"{n}_again", partial(play_scenes, s, 4, AGAIN_S)) for n, s in SCENES.items()]
    shifts = [(name, partial(play_shift, shift)) for name, shift in SHIFTS.items()]
    made = [Probe(name=n, play=p, is_short=True) for n, p in (*scenes, *shifts)]
    return (*plain, *made)


PROBES = _probes()
