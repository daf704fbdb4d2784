"""Recorded motion: read from files of several formats, mended, put on workers, cut and played."""

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.behaviour import doors
from tests.behaviour.probe import Played, Probe, Values

FPS = 25.0
PERSON = "worker_1"
LOOSE, EXACT = 2e-4, 1e-4
"""Units to which stored motion is rounded: of places [m], of turns."""
ACTS = ("walk 1.3 m/s", "turn", "kneel", "lunge", "squat")


def film_acts() -> Values:
    """Return the segments of somebody in several scenes, four seconds of each."""
    film: Values = {}
    for k, name in enumerate(ACTS):
        done = doors.perform_scene(name, PERSON, (0.4, -0.3, 0.8), True, k, 1.0 / FPS)
        first = 15 if name.startswith("walk") else 0
        part = slice(first, first + 100)
        film[f"{k}/position_m"] = np.round(done["position_m"][part] / LOOSE).astype(np.int16)
        film[f"{k}/turn"] = np.round(done["turn"][part] / EXACT).astype(np.int16)
    return film


def segments_of(film: Values, k: int) -> Values:
    """Return the segments of one of the acts."""
    turn = film[f"{k}/turn"] * EXACT
    turn /= np.linalg.norm(turn, axis=-1, keepdims=True)
    return {"position_m": film[f"{k}/position_m"] * LOOSE, "turn": turn}


def joints_of(film: Values, k: int) -> NDArray[np.float64]:
    """Return the joints (T, 15, 3) in one of the acts [m]."""
    return doors.joints_of_segments(segments_of(film, k), PERSON)


def weigh(values: NDArray[Any]) -> NDArray[np.float64]:
    """Return a sum with unlike weights of all numbers of each step (n, ...): (n,), which moves when
    any of them does."""
    flat = np.reshape(np.asarray(values, float), (len(values), -1))
    return np.nan_to_num(flat, nan=3.0) @ np.cos(1.0 + np.arange(flat.shape[1]) ** 1.3)


# --- Formats -------------------------------------------------------------------------------------

FORMATS: dict[str, dict[str, Any]] = {
    "metres": {"form": "bvh"},
    "centimetres": {
        "form": "bvh", "unit_m": 0.01, "is_y_up": True, "order": 3, "prefix": "mixamorig:",
    },
    "inches": {"form": "bvh", "unit_m": 0.0254, "order": 1, "has_rest_pose": True},
    "acclaim": {"form": "amc"},
}  # fmt: skip
RATES: tuple[dict[str, Any], ...] = (
    {"source_fps": FPS}, {"source_fps": FPS, "fps": 10.0}, {"source_fps": FPS, "fps": 60.0}, {},
)  # fmt: skip


def play_formats(inputs: Values) -> Played:
    """Read the same motion from files of several formats, units, axes and rates."""
    values: Values = {}
    for k, name in enumerate(ACTS):
        for label, form in FORMATS.items():
            with tempfile.TemporaryDirectory() as folder:
                path = doors.write_capture(
                    Path(folder), segments=segments_of(inputs, k), body=PERSON, fps=FPS, **form
                )
                read = doors.read_recording(path, is_off_floor_allowed=True, **RATES[k % 4])
                again = doors.read_recording(path, **RATES[(k + 1) % 4])
            values[f"{name}/{label}/is refused"] = np.array([read is None, again is None])
            values |= _tidied(f"{name}/{label}", read) | _tidied(f"{name}/{label}/again", again)
    return Played(values)


def _tidied(label: str, read: Values | None) -> Values:
    if read is None:
        return {}
    kept = {"sum of joints": weigh(read["joints_m"]), "facts": read["facts"]}
    kept["names"] = read["names"]
    return {f"{label}/{name}": value for name, value in kept.items()}


# --- What is wrong with files --------------------------------------------------------------------

Trap = Callable[[NDArray[np.float64], float], NDArray[np.float64]]


def _turned(joints: NDArray[np.float64], axis: int, angle_rad: float) -> NDArray[np.float64]:
    i, j = [k for k in range(3) if k != axis]
    turned, c, s = joints.copy(), np.cos(angle_rad), np.sin(angle_rad)
    turned[..., i] = c * joints[..., i] - s * joints[..., j]
    turned[..., j] = s * joints[..., i] + c * joints[..., j]
    return turned


def _with_gap(joints: NDArray[np.float64], seconds: float) -> NDArray[np.float64]:
    spoilt = joints.copy()
    spoilt[20 : 20 + round(seconds * FPS), 5] = np.nan
    spoilt[5, 5] = spoilt[:3, 0] = np.nan
    spoilt[-2:, 8] = np.nan
    return spoilt


def _with_other_start(joints: NDArray[np.float64], metres: float) -> NDArray[np.float64]:
    spoilt = joints.copy()
    spoilt[0, 1:7] += (0.0, metres, metres)
    return spoilt


def _hopping(joints: NDArray[np.float64], seconds: float) -> NDArray[np.float64]:
    spoilt, n = joints.copy(), round(seconds * FPS)
    rise = np.concatenate([np.linspace(0.0, 1.0, 4), np.ones(n), np.linspace(1.0, 0.0, 4)])
    spoilt[30 : 30 + len(rise), :, 2] += 0.25 * rise[: len(spoilt) - 30, None]
    return spoilt


def _on_a_step(joints: NDArray[np.float64], metres: float) -> NDArray[np.float64]:
    spoilt = joints.copy()
    spoilt[50:, :, 2] += metres
    return spoilt


def _with_long_arms(joints: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    spoilt = joints.copy()
    spoilt[:, 3] = joints[:, 1] + share * (joints[:, 3] - joints[:, 1])
    return spoilt


def _with_bent_knees(joints: NDArray[np.float64], metres: float) -> NDArray[np.float64]:
    spoilt = joints.copy()
    spoilt[:, 9:11] += metres * _ahead(joints)[:, None]
    return spoilt


def _with_other_feet(joints: NDArray[np.float64], metres: float) -> NDArray[np.float64]:
    spoilt = joints.copy()
    spoilt[:, 13:15] += metres * _ahead(joints)[:, None]
    return spoilt


def _hanging(joints: NDArray[np.float64], metres: float) -> NDArray[np.float64]:
    spoilt = joints.copy()
    spoilt[:, 3:5] = spoilt[:, 1:3] + (0.0, 0.0, 0.28)
    spoilt[:, 5:7] = spoilt[:, 1:3] + (0.0, 0.0, 0.55)
    return np.add(spoilt, (0.0, 0.0, metres))


def _ahead(joints: NDArray[np.float64]) -> NDArray[np.float64]:
    ahead = np.cross(joints[:, 7] - joints[:, 8], [0.0, 0.0, 1.0])
    return ahead / np.linalg.norm(ahead, axis=-1, keepdims=True)


TRAPS: dict[str, tuple[Trap, Any]] = {
    "tall": (lambda joints, share: share * joints, np.geomspace(0.68, 1.4, 16)),
    "tall in another unit": (
        lambda joints, share: share * joints,
        (100.0, 1000.0, 39.4, 17.7, 3.0, 120.0, 1250.0, 50.0, 22.0, 0.1),
    ),
    "leaning": (lambda joints, a: _turned(joints, 0, a), np.linspace(0.4, 0.8, 9)),
    "other axis": (
        lambda joints, a: _turned(joints, int(a) % 3, np.pi / 2 * (1 + int(a) // 3)),
        range(9),
    ),
    "mirrored": (
        lambda joints, a: joints * np.where(np.arange(3) == int(a), -1.0, 1.0), range(3)
    ),
    "gap": (_with_gap, np.arange(0.04, 0.45, 0.04)),
    "other start": (_with_other_start, np.geomspace(0.02, 0.8, 14)),
    "aslant": (lambda joints, a: _turned(joints, 1, a), (*np.linspace(0.003, 0.03, 8),
                                                         *np.linspace(0.05, 0.09, 6))),
    "off the floor": (
        lambda joints, metres: np.add(joints, (0.0, 0.0, metres)), np.linspace(-0.16, 0.16, 17)
    ),
    "hanging": (_hanging, np.linspace(0.0, 0.3, 7)),
    "hopping": (_hopping, np.arange(0.12, 1.2, 0.08)),
    "on a step": (_on_a_step, np.linspace(-0.15, 0.15, 16)),
    "long arms": (_with_long_arms, np.geomspace(0.18, 3.0, 16)),
    "knees": (_with_bent_knees, np.linspace(-0.3, 0.2, 11)),
    "feet": (_with_other_feet, np.linspace(-0.4, 0.2, 11)),
}  # fmt: skip
"""What is wrong with a recording, by how much."""


def play_traps(inputs: Values) -> Played:
    """Read recordings in which something is wrong, the more the worse, until they are refused."""
    values: Values = {}
    joints = joints_of(inputs, 0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "joints.npz"
        for label, (spoil, amounts) in TRAPS.items():
            read = []
            for amount in amounts:
                np.savez(path, joints=spoil(joints, float(amount)), fps=FPS)
                for allowed in (False, True):
                    read.append(_judged(doors.read_recording(path, None, None, allowed)))
            values[label] = np.array(read)
    return Played(values)


Change = Callable[[list[str]], list[str]]
CHANGES: dict[str, Change] = {
    "as it is": lambda lines: lines,
    "without a line": lambda lines: lines[:-1],
    "without half a line": lambda lines: [*lines[:-1], lines[-1][: len(lines[-1]) // 2]],
    "without forty lines": lambda lines: lines[:-40],
    "without sixty lines": lambda lines: lines[:-60],
    "with a line": lambda lines: [*lines, lines[-1]],
    "with a short line": lambda lines: [*lines[:-9], lines[-9][:20], *lines[-8:]],
    "with a word": lambda lines: [*lines[:-9], lines[-9].replace("1", "x"), *lines[-8:]],
    "without a channel": lambda lines: [line.replace(" Zrotation", "") for line in lines],
    "without a knee": lambda lines: [line.replace("LeftLeg", "Beam") for line in lines],
    "without sides": lambda lines: [line.replace("Left", "") for line in lines],
    "with a nose": lambda lines: [line.replace("Neck", "Nose") for line in lines],
    "with other names": lambda lines: [line.replace("UpLeg", "Thigh").replace("Leg", "Shin")
                                       for line in lines],
    "slower": lambda lines: [line.replace("0.040000", "0.080000") for line in lines],
    "without a rate": lambda lines: [line.replace("0.040000", "0.0") for line in lines],
    "off the floor": lambda lines: [_lifted(line) for line in lines],
    "in radians": lambda lines: [line.replace(":DEGREES", ":RADIANS") for line in lines],
    "in lower case": lambda lines: [line.lower() for line in lines],
}  # fmt: skip
"""What is changed in the text of a file."""


def _lifted(line: str) -> str:
    words = line.split(" ")
    if words[0] == "root" and len(words) == 7:
        words[2] = str(float(words[2]) + 8.0)
    return " ".join(words)


def play_damage(inputs: Values) -> Played:
    """Read files that are cut off, changed or of other skeletons."""
    values: Values = {}
    for label in ("metres", "acclaim"):
        with tempfile.TemporaryDirectory() as folder:
            path = doors.write_capture(
                Path(folder), segments=segments_of(inputs, 0), body=PERSON, fps=FPS,
                **FORMATS[label],
            )  # fmt: skip
            lines, read = path.read_text().splitlines(), []
            for change in CHANGES.values():
                path.write_text("\n".join(change(list(lines))))
                for allowed in (False, True):
                    rate = None if label == "metres" else FPS
                    read.append(_judged(doors.read_recording(path, None, rate, allowed)))
        values[label] = np.array(read)
    return Played(values)


def _judged(read: Values | None) -> tuple[float, float, float]:
    """Return whether a recording was accepted, how much was mended, and a sum of all joints."""
    if read is None:
        return 0.0, 0.0, 0.0
    return 1.0, float(read["facts"][0, 2]), float(weigh(read["joints_m"][None])[0])


def play_rates(inputs: Values) -> Played:
    """Read short and slow recordings, and judge floor and person of all acts."""
    values: Values = {}
    joints, read = joints_of(inputs, 0), []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "joints.npz"
        for n in (1, 2, 5, 10, 12, 13, 14, 15, 20, 40):
            for fps in (4.0, 4.9, 5.2, 25.0, 950.0, 1100.0):
                np.savez(path, joints=joints[:n], fps=fps)
                read.append(_judged(doors.read_recording(path, 30.0, None, True)))
    values["rates"] = np.array(read)
    for k, name in enumerate(ACTS):
        joints = joints_of(inputs, k)
        floor = doors.judge_floor(_turned(joints, 1, 0.03), FPS)
        floor["level_m"] = weigh(floor["level_m"])
        values |= {f"{name}/{key}": value for key, value in floor.items()}
        values[f"{name}/person"] = doors.measure_person(joints)
        for wished in (7.0, 24.0, 26.0, 60.0):
            values[f"{name}/at {wished} Hz"] = weigh(doors.resample(joints, FPS, wished))
    return Played(values)


# --- Clips ---------------------------------------------------------------------------------------

CASES: tuple[tuple[int, bool, str, float], ...] = (
    (0, True, "worker_1", 1.0), (1, False, "worker_3", 1.08), (2, True, "worker_6", 0.93),
)  # fmt: skip
"""Act, whether its joints are landmarks, the body that it is put on, size of the person."""


def play_clips(inputs: Values) -> Played:
    """Put recorded people on workers of other measures."""
    values: Values = {}
    for k, are_landmarks, body, size in CASES:
        joints = size * joints_of(inputs, k)[:75]
        clip, error = doors.make_clip(joints, FPS, are_landmarks, body)
        made = doors.describe_clip(clip, error)
        made["sum of controls"] = weigh(made["controls"])
        made["controls"] = made["controls"][::10]
        values |= {f"{ACTS[k]}/{name}": value for name, value in made.items()}
        for other in ("worker_2", "worker_5"):
            values[f"{ACTS[k]}/for {other}"] = weigh(doors.fit_clip(clip, other))
    return Played(values)


def play_steps(inputs: Values) -> Played:
    """Look at what is made of a recording step by step."""
    values: Values = {}
    for k in (3, 4):
        steps = doors.fit_steps(1.05 * joints_of(inputs, k)[10:60], FPS, "worker_4")
        for name, value in steps.items():
            values[f"{ACTS[k]}/{name}"] = weigh(value[:, None]) if value.ndim > 1 else value
    return Played(values)


def film_clips() -> Values:
    """Return acts put on a worker, as they are stored."""
    film, stored = film_acts(), Values()
    for k in range(3):
        clip, error = doors.make_clip(joints_of(film, k), FPS, True, PERSON)
        made = doors.describe_clip(clip, error)
        for name in ("controls", "contacts", "size"):
            value = made[name]
            stored[f"{k}/{name}"] = value.astype(np.float32) if value.dtype.kind == "f" else value
    return stored


def play_cut(inputs: Values) -> Played:
    """Cut clips into pieces that have room, and let workers play them in a shift."""
    clips = [
        doors.made_clip({n: inputs[f"{k}/{n}"] for n in ("controls", "contacts", "size")}, FPS)
        for k in range(3)
    ]
    names, values = ("worker_2", "worker_7"), Values()
    for place in ("lab", "site", "open"):
        for k in range(3):
            cut = doors.cut_clips(clips[: k + 1], names, place)
            values[f"{place}/{k}/is refused"] = np.array([cut is None])
            if cut is not None:
                cut["frames"], cut["starts"] = weigh(cut["frames"]), weigh(cut["starts"])
                values |= {f"{place}/{k}/{name}": value for name, value in cut.items()}
    settings = {"motions_probability": 0.8, "near_probability": 0.5, "dwell_s": (2.0, 4.0)}
    crew = doors.Crew(
        "lab", 2, 2, names, "attentive", 61, settings=settings, clips=tuple(clips)
    )  # fmt: skip
    moments, sums = [], []
    for k in range(600):
        crew.go_on(0.05, 2)
        moved = crew.move()
        if k % 10 == 9:
            moments.append(moved["activity"])
        sums.append([weigh(moved[name][None])[0] for name in ("position_m", "turn", "path_m")])
    values |= {
        "shift/activity": np.stack(moments),
        "shift/sums": np.array(sums).reshape(-1, 5, 3).sum(1),
    }
    return Played(values)


def _probe(name: str, play: Callable[[Values], Played], is_short: bool = True) -> Probe:
    return Probe(name=name, play=play, inputs=film_acts, is_short=is_short)


def play_together(parts: dict[str, Callable[[Values], Played]], inputs: Values) -> Played:
    """Play several scenarios with the same recorded people."""
    played = {label: part(inputs).values for label, part in parts.items()}
    return Played({f"{p}/{name}": v for p, each in played.items() for name, v in each.items()})


READ: dict[str, Callable[[Values], Played]] = {
    "formats": play_formats, "damage": play_damage, "traps": play_traps, "rates": play_rates,
    "clips": play_clips, "steps": play_steps,
}  # fmt: skip

PROBES = (
    _probe("recordings", partial(play_together, READ)),
    Probe(name="played", play=play_cut, inputs=film_clips, is_short=True),
)
