"""Keypoints without pixels: how cameras see people, how the detector errs, what goes wrong."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.behaviour import doors
from tests.behaviour.probe import Played, Probe, Values, stack

STEP_S = 0.04
N_WORKERS, BATCH = 3, 2
N_JOINTS = 15
LENSED: tuple[dict[str, Any], ...] = (
    {"name": "fisheye", "make": "gopro_hero8_wide", "eye_m": (2.9, 2.6, 2.45),
     "target_m": (0.6, 0.0, 1.0)},
    {"name": "brown", "eye_m": (-1.4, -2.2, 2.3), "target_m": (1.0, 0.2, 0.9), "field_deg": 80.0,
     "lens": ("brown_conrady", (-0.1, 0.01, 0.001, -0.002)), "width_px": 1280, "height_px": 720},
    {"name": "near", "eye_m": (1.9, 0.4, 1.5), "target_m": (0.6, -0.1, 1.0), "field_deg": 60.0,
     "roll_deg": 12.0},
)  # fmt: skip
"""Two lenses, and a camera in the midst of people: some are behind it, or partly in its image."""


# --- People before cameras -----------------------------------------------------------------------


def film_people(place: str, seed: int, n_images: int) -> Values:
    """Return people of several bodies who go about their work in a scene, every few seconds."""
    settings = {"near_probability": 0.5, "dwell_s": (2.0, 6.0)}
    people = {"run_probability": 0.3, "fall_probability": 0.2, "tempo": 0.5}
    crew = doors.Crew(
        place, BATCH, N_WORKERS, doors.BODY_NAMES, people, seed, settings=settings
    )  # fmt: skip
    images = []
    for _ in range(n_images):
        crew.go_on(0.05, 34)
        moved = crew.move()
        held = {name: moved[name] for name in ("held", "held_m", "held_turn")}
        images.append({**crew.see(), **held})
    film = stack(images)
    return {name: np.round(film[name] / unit).astype(np.int16) for name, unit in UNITS.items()}


UNITS = {
    "joints_m": 2e-4, "joint_speed_m_s": 1e-3, "capsules_m": 2e-4, "radius_m": 1e-4, "held": 1,
    "held_m": 2e-4, "held_turn": 1e-4,
}  # fmt: skip
"""What films of people are rounded to: their files are small then."""


def people_at(film: Values, k: int) -> Values:
    """Return people of one moment."""
    people = {name: value[k] * UNITS[name] for name, value in film.items()}
    length = np.linalg.norm(people["held_turn"], axis=-1, keepdims=True)
    people["held_turn"] /= np.maximum(length, 0.5)
    return people


def arm_at(rig: doors.Rig, k: int) -> NDArray[np.float64]:
    """Return angles of the arm at one moment, (B, N)."""
    n = len(rig.home_q)
    sway = 0.4 * np.sin(0.7 * k + np.arange(n) + np.arange(BATCH)[:, None])
    return rig.home_q + sway


VARIANTS: dict[str, dict[str, Any]] = {
    "as it is": {},
    "exact": {"error_scale": 0.0, "swap_share": 0.0, "miss_share": 0.0},
    "far off": {"error_scale": 3.0, "max_error": 0.03},
    "confused": {"swap_share": 0.4, "miss_share": 0.25, "outside_confidence": 0.02},
    "choosy": {"min_joints": 11},
}
"""Settings of the emulator."""


def play_emulator(place: str, cameras: Any, names: tuple[str, ...], inputs: Values) -> Played:
    """Look at people with every kind of settings, with tracks near to some of them or none."""
    rig = doors.Rig(place, cameras)
    values: Values = {}
    for number, name in enumerate(names):
        emulator, exact = (
            doors.Emulator(rig, BATCH, N_WORKERS, STEP_S, 50 + number, **VARIANTS[variant])
            for variant in (name, "exact")
        )
        images = []
        for k in range(len(inputs["held"])):
            people = people_at(inputs, k)
            expected = expect(people, k) if k % 3 else None
            has_no_names = name == "confused" and k % 2 == 1
            found = emulator.report(people, arm_at(rig, k), expected, None, has_no_names)
            images.append(tidy(found, exact.report(people, arm_at(rig, k))))
        values |= {f"{name}/{key}": value for key, value in stack(images).items()}
        values |= {f"{name}/memory/{key}": weigh(v, 1) for key, v in emulator.remember().items()}
    return Played(values)


def tidy(found: Values, exact: Values) -> Values:
    """Return sums with unlike weights of all that is reported of an image, by camera (B, C, ...),
    and pixels of some joints; deviations as logarithms, which are equally exact of all sizes."""
    return {
        "sum of exact px": weigh(exact["px"], 2),
        "sum of errors": weigh(found["px"] - exact["px"], 2),
        "sum of confidences": weigh(found["confidence"], 2),
        "sum of log sigma": weigh(np.log(found["sigma_px"]), 2),
        "px": found["px"][:, :, 0, ::4],
    }


def weigh(values: NDArray[Any], n_axes: int) -> NDArray[np.float64]:
    """Return a sum with unlike weights of all numbers behind the first axes, which moves when any
    of them does."""
    flat = np.reshape(np.asarray(values, float), (*np.shape(values)[:n_axes], -1))
    flat = np.nan_to_num(flat, nan=3.0, posinf=5.0, neginf=-5.0)
    return flat @ np.cos(1.0 + np.arange(flat.shape[-1]) ** 1.3)


def expect(people: Values, k: int) -> Any:
    """Return what a tracker expects of people: near, too far from them, in another order."""
    rng = np.random.default_rng([60, k])
    joints = people["joints_m"][:, ::-1] + rng.normal(0.0, 0.05, (BATCH, N_WORKERS, 1, 3))
    joints[:, 0] += rng.choice([0.1, 0.6], (BATCH, 1, 1)) * np.array([1.0, 0.3, 0.0])
    speed = people["joint_speed_m_s"][:, ::-1] * rng.uniform(0.3, 1.5)
    return doors.make_estimate(joints, speed, rng.random((BATCH, N_WORKERS)) < 0.8)


def play_sight(place: str, cameras: Any, inputs: Values) -> Played:
    """Find out how cameras see joints and people."""
    rig = doors.Rig(place, cameras)
    views = [
        rig.see_lines(people_at(inputs, k), arm_at(rig, k)) for k in range(len(inputs["held"]))
    ]
    seen = stack(views)
    known = {name: weigh(value, 1) for name, value in rig.describe().items()}
    return Played({"sight": seen["sight"].astype(np.int8), "look": weigh(seen["look"], 3), **known})


# --- Posture, deviations, belief -----------------------------------------------------------------


def play_postures(inputs: Values) -> Played:
    """Describe people's postures, and those of nobody: flat, upside down, in one point."""
    rng = np.random.default_rng(70)
    seen = []
    for k in range(len(inputs["held"])):
        people = people_at(inputs, k)
        for b, w in np.ndindex(BATCH, N_WORKERS):
            joints, speed = people["joints_m"][b, w].copy(), people["joint_speed_m_s"][b, w]
            if k % 5 == 3:
                joints[:, 2] *= rng.uniform(0.2, 1.0)
            if k % 5 == 4:
                joints += rng.normal(0.0, 0.15, joints.shape)
            eye_m = rng.uniform(-3.0, 3.0, 3)
            seen.append(doors.describe_posture(joints, speed * rng.uniform(0.1, 2.0), eye_m))
    one_point = np.ones((N_JOINTS, 3))
    seen.append(doors.describe_posture(one_point, one_point, np.zeros(3)))
    values = stack(seen)
    return Played({**values, "pose": weigh(values["pose"], 1)})


def play_deviations(inputs: Values) -> Played:
    """State deviations of joints, and correct estimates of what the network means."""
    confidence = np.tile(np.linspace(-0.02, 1.0, 35)[:, None], N_JOINTS)
    postures = [*np.eye(5), np.full(5, 0.2)]
    stated = [doors.deviate(confidence, 300.0, tuple(each)) for each in postures]
    stated.append(doors.deviate(confidence, np.linspace(50.0, 900.0, 35)[:, None]))
    values: Values = {"stated_px": np.log(np.stack(stated))}
    rng, corrected = np.random.default_rng(71), []
    for k in range(len(inputs["held"])):
        people = people_at(inputs, k)
        joints = people["joints_m"] + rng.normal(0.0, 0.03 * (k % 4), people["joints_m"].shape)
        factor = rng.normal(0.0, 0.05, (*joints.shape, 3))
        cov = factor @ np.swapaxes(factor, -1, -2) + 1e-4 * np.eye(3)
        tracked = rng.random((BATCH, N_WORKERS)) < 0.8
        estimate = doors.make_estimate(joints, people["joint_speed_m_s"], tracked, cov)
        corrected.append(doors.correct_joints(estimate))
    sums = {f"sum of {name}": weigh(value, 3) for name, value in stack(corrected).items()}
    return Played(values | sums)


def play_belief(inputs: Values) -> Played:
    """Judge whether keypoints are a person's: of several cameras and one, true and spoilt."""
    values: Values = {}
    for label, kept in (("four", None), ("one", (0,)), ("lensed", LENSED)):
        cameras = LENSED if label == "lensed" else ()
        rig = doors.Rig("lab", cameras) if kept != (0,) else doors.Rig("lab", (ALONE,))
        emulator = doors.Emulator(rig, BATCH, N_WORKERS, STEP_S, 80, miss_share=0.1)
        rng, judged = np.random.default_rng(81), []
        for k in range(len(inputs["held"])):
            people = people_at(inputs, k)
            for b, w in np.ndindex(BATCH, N_WORKERS):
                people["joints_m"][b, w] = _spoil(people["joints_m"][b, w], rng)
            found = emulator.report(people, arm_at(rig, k))
            for b, w in np.ndindex(BATCH, N_WORKERS):
                one = {name: value[b, :, w] for name, value in found.items()}
                judged.append([doors.believe(rig, one, is_known) for is_known in (True, False)])
        values[label] = np.array(judged)
    return Played(values)


ALONE = {"name": "alone", "eye_m": (3.2, 0.5, 1.9), "target_m": (0.6, 0.0, 0.9), "field_deg": 95.0}


def _spoil(joints_m: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return a body stretched, pressed together, lifted or as it is."""
    middle = joints_m.mean(0) * (1.0, 1.0, 0.0)
    stretch = rng.choice([0.55, 0.7, 0.85, 1.0, 1.0, 1.2, 1.4, 1.6])
    return middle + (joints_m - middle) * stretch + (0.0, 0.0, rng.choice([0.0, 0.0, 0.3]))


def play_calibration(inputs: Values) -> Played:
    """Read the tables of the calibration, and of faults."""
    values = {f"faults/{name}": value for name, value in doors.fault_table().items()}
    for name, table in doors.read_tables().items():
        values[name] = table.reshape(len(table), -1)
    return Played(values)


# --- Faults --------------------------------------------------------------------------------------

TIMED: tuple[dict[str, Any], ...] = (
    {"name": "slow", "eye_m": (2.9, 2.6, 2.45), "target_m": (0.2, 0.0, 1.0), "rate_hz": 10.0},
    {"name": "late", "eye_m": (-2.9, 2.6, 2.45), "target_m": (0.2, 0.0, 1.0), "latency_s": 0.13},
    {"name": "both", "eye_m": (-2.9, -2.6, 2.4), "target_m": (0.2, 0.0, 1.0), "latency_s": 0.04,
     "rate_hz": 18.0, "exposure_s": 0.02},
    {"name": "plain", "eye_m": (2.9, -2.6, 2.45), "target_m": (0.2, 0.0, 1.0)},
)  # fmt: skip
"""Cameras that do not give an image at each step."""
N_STEPS = 45


def episodes() -> dict[str, tuple[dict[str, Any], ...]]:
    """Return what goes wrong in several episodes: each kind by itself, and several at once."""
    alone: dict[str, tuple[dict[str, Any], ...]] = {
        kind: ({"kind": kind, "cameras": (k % 4, "slow")},)
        for k, kind in enumerate(doors.FAULT_KINDS)
    }
    some = ("late", "both")
    alone["nothing"] = ()
    alone["frozen at last"] = ({"kind": "frozen", "cameras": ("all",), "from_s": 0.41},)
    alone["lost for a while"] = (
        {"kind": "lost", "cameras": some, "from_s": 0.4, "until_s": 1.0},
        {"kind": "late", "cameras": some, "amount": 0.1, "from_s": 1.0},
        {"kind": "dropped", "cameras": ("plain",), "amount": 0.6},
    )
    alone["out of step and away"] = (
        {"kind": "out_of_step", "cameras": ("all",), "amount": 3.4, "until_s": 1.2},
        {"kind": "wrong_translation", "cameras": (1, 3), "amount": 0.2},
        {"kind": "wrong_focal", "cameras": (1,), "amount": -0.1, "from_s": 0.8},
        {"kind": "knocked", "cameras": (0, 1), "from_s": 0.6},
    )
    return alone


def play_faults(inputs: Values) -> Played:
    """List which images come, and where cameras really are, through episodes with faults."""
    rig, values = doors.Rig("lab", TIMED), Values()
    for number, (name, wrong) in enumerate(episodes().items()):
        faults = doors.Faults(rig, wrong, STEP_S)
        seeds = faults.begin(90 + number)
        images, places, arrived = [], [], []
        for step in range(N_STEPS):
            images.append(faults.list_images(int(seeds[0]), step))
            arrived.append(faults.arrive(0))
            if step % 6 == 0:
                places.append(faults.places(faults.move_cameras(int(seeds[1]), step)))
        values |= {
            f"{name}/seeds": seeds, f"{name}/summary": faults.summarise(),
            f"{name}/images": np.stack(images), f"{name}/arrived": np.stack(arrived),
        }  # fmt: skip
        values |= {f"{name}/{key}": weigh(value, 2) for key, value in stack(places).items()}
    return Played(values)


def play_displaced(inputs: Values) -> Played:
    """Look at people with cameras that hang elsewhere than is known."""
    rig, values = doors.Rig("lab", TIMED), Values()
    for kind in ("wrong_rotation", "wrong_translation", "wrong_focal", "knocked"):
        faults = doors.Faults(rig, ({"kind": kind, "cameras": ("all",)},), STEP_S)
        emulator = doors.Emulator(rig, BATCH, N_WORKERS, STEP_S, 95)
        images = []
        for k in range(0, len(inputs["held"]), 4):
            cameras = faults.move_cameras(7, k)
            found = emulator.report(people_at(inputs, k), arm_at(rig, k), None, cameras)
            images.append(weigh(found["px"], 3))
        values[f"{kind}/sum of px"] = np.stack(images)
    return Played(values)


# --- Together ------------------------------------------------------------------------------------


def play_together(parts: dict[str, Callable[[Values], Played]], inputs: Values) -> Played:
    """Play several scenarios with the same people."""
    played = {label: part(inputs).values for label, part in parts.items()}
    return Played({f"{p}/{name}": v for p, each in played.items() for name, v in each.items()})


LOOKS: dict[str, Callable[[Values], Played]] = {
    "lenses": partial(play_emulator, "lab", LENSED, ("as it is", "exact")),
    "sight": partial(play_sight, "lab", LENSED),
    "postures": play_postures,
    "deviations": play_deviations,
    "belief": play_belief,
    "displaced": play_displaced,
}
AT_SITE: dict[str, Callable[[Values], Played]] = {
    "emulator": partial(play_emulator, "site", (), ("as it is", "confused")),
    "sight": partial(play_sight, "site", ()),
}


def _probe(name: str, play: Callable[[Values], Played], film: tuple[str, int, int]) -> Probe:
    """Return a probe of the short form (all of them take a second), with people on film."""
    return Probe(name=name, play=play, inputs=partial(film_people, *film), is_short=True)


PROBES = (
    _probe("lab", partial(play_emulator, "lab", (), tuple(VARIANTS)), ("lab", 31, 10)),
    _probe("looks", partial(play_together, LOOKS), ("lab", 33, 14)),
    _probe("site", partial(play_together, AT_SITE), ("site", 32, 12)),
    Probe(name="calibration", play=play_calibration, is_short=True),
    Probe(name="faults", play=play_faults, is_short=True),
)
