"""The detector: windows, tensors, lenses, spoilt images, and the network on twelve stored crops.

The crops were drawn by the project's own renderer: no frame shows a real person.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.behaviour import doors
from tests.behaviour.probe import Played, Probe, Values, stack

NETWORK_TOLERANCE = 1e-3
"""Of what the network says, in shares of a window's side: its sums are in single precision, and
their order is another on processors with other instructions."""
IMAGE_TOLERANCE = 3e-4
"""Of grey levels as shares of white, means over 64 pixels: a pixel may be rounded the other way."""
FOLLOWED_TOLERANCE = 3e-3
"""Of what is believed of somebody whom the network finds [m, m/s, s]."""
DRAWN_TOLERANCE = 0.03
"""The same of drawn pictures: drivers of graphics draw edges and shades a little differently."""
BODIES = ("worker_1", "worker_4", "worker_6")
LENSED: tuple[dict[str, Any], ...] = (
    {"name": "fisheye", "make": "gopro_hero8_wide", "eye_m": (2.9, 2.6, 2.45),
     "target_m": (0.6, 0.0, 1.0)},
    {"name": "brown", "eye_m": (-1.4, -2.2, 2.3), "target_m": (1.0, 0.2, 0.9), "field_deg": 80.0,
     "lens": ("brown_conrady", (-0.1, 0.01, 0.001, -0.002)), "width_px": 1280, "height_px": 720},
    {"name": "upright", "eye_m": (3.4, 0.4, 1.5), "target_m": (0.6, -0.1, 1.0), "field_deg": 60.0,
     "width_px": 720, "height_px": 1280, "roll_deg": 12.0},
)  # fmt: skip
NEIGHBOURS: tuple[dict[str, Any], ...] = (
    {"name": "left", "eye_m": (2.6, 0.9, 1.6), "target_m": (0.4, 0.2, 1.0)},
    {"name": "middle", "eye_m": (2.2, 0.0, 1.9), "target_m": (0.4, 0.0, 1.0)},
    {"name": "right", "eye_m": (2.7, -0.8, 1.3), "target_m": (0.3, 0.1, 1.0), "field_deg": 70.0},
)  # fmt: skip
Window = tuple[float, float, float, float]
"""Middle x and y, side [px] and turn [rad]."""
STICKS = np.array(
    [
        (0.12, 0.0, 1.60),
        (0.0, 0.18, 1.43), (0.0, -0.18, 1.43), (0.0, 0.28, 1.16), (0.0, -0.28, 1.16),
        (0.1, 0.32, 0.92), (0.1, -0.32, 0.92), (0.0, 0.11, 0.94), (0.0, -0.11, 0.94),
        (0.03, 0.12, 0.51), (0.03, -0.12, 0.51), (0.0, 0.13, 0.10), (0.0, -0.13, 0.10),
        (0.17, 0.14, 0.04), (0.17, -0.14, 0.04),
    ]
)  # fmt: skip
"""Somebody who stands [m]."""


def draw_people(rng: np.random.Generator, n: int) -> list[NDArray[np.float64]]:
    """Return bodies of sticks (15, 3), some bent, with hands anywhere, all about the room [m]."""
    people = []
    for _ in range(n):
        joints = STICKS * rng.uniform(0.8, 1.15)
        joints[3:7] += rng.normal(0.0, 0.25, (4, 3))
        joints[:, 0] += rng.uniform(0.0, 0.6) * np.maximum(joints[:, 2] - 0.9, 0.0)
        joints[:, 2] *= rng.choice([1.0, 1.0, 0.6, 0.35])
        yaw = rng.uniform(-np.pi, np.pi)
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        joints[:, :2] = joints[:, :2] @ turn.T + rng.uniform((-0.5, -2.5), (3.6, 2.5))
        people.append(joints)
    return people


# --- Windows and tensors -------------------------------------------------------------------------


def play_windows(inputs: Values) -> Played:
    """Find windows round people, keep them, and lay out searches."""
    values: Values = {}
    rng = np.random.default_rng(10)
    for label, cameras in (("lab", ()), ("lenses", LENSED)):
        rig = doors.Rig("lab", cameras)
        n_cameras, found = len(rig.cameras), []
        for joints in draw_people(rng, 40):
            for c in range(n_cameras):
                px, depth = doors.project_joints(rig, c, joints)
                found.append(doors.window_round(rig, c, px, depth))
        values[f"{label}/windows"] = np.array(found)
        for c in range(n_cameras):
            for is_known in (True, False):
                places = doors.search_places(rig, c, is_known)
                values[f"{label}/search {c} {is_known}"] = places
    kept = (500.0, 400.0, 300.0, 3.05)
    grid = np.linspace(-1.0, 1.0, 41)
    for name, step in (("x", 45.0), ("y", -40.0), ("side", 70.0), ("turn", 0.35)):
        at = ("x", "y", "side", "turn").index(name)
        wanted = [tuple(v + step * s * (k == at) for k, v in enumerate(kept)) for s in grid]
        values[f"keeps/{name}"] = np.array([doors.keeps_window(kept, each) for each in wanted])
    points = rng.uniform(0.0, 600.0, (30, 2, 2))
    values["of points"] = np.array([doors.window_of_points(*each) for each in points])
    placed = [doors.place_points(p / 600.0, w) for p, w in zip(points, values["of points"],
                                                               strict=True)]  # fmt: skip
    return Played({**values, "placed": np.stack(placed)})


def play_tensors(inputs: Values) -> Played:
    """Decode tensors like those of both stages: people near each other, doubtful points."""
    rng, values = np.random.default_rng(11), Values()
    for k in range(3):
        boxes = rng.normal(0.0, 6.0, (2254, 12)).astype(np.float32)
        boxes[:, 2:4] = rng.uniform(5.0, 60.0, (2254, 2))
        logits = np.full(2254, -9.0, np.float32)
        sure = rng.choice(2254, 60, replace=False)
        logits[sure] = rng.uniform(-0.6, 4.0, 60)
        logits[900:903] = (90.0, 3.0, 2.9)
        window = (640.0, 360.0, 900.0, 0.3 * k)
        values[f"people {k}"] = doors.decode_people(boxes, logits, window)
    landmarks = []
    for k in range(8):
        points = rng.uniform(-12.0, 268.0, (39, 5)).astype(np.float32)
        points[:, 3] = rng.normal(0.0, 3.0, 39)
        heat = rng.normal((-6.0, -1.5, -0.2, 1.0)[k % 4], 1.0, (64, 64, 39)).astype(np.float32)
        landmarks.append(doors.decode_landmarks(points, heat))
    return Played({**values, "landmarks": np.stack(landmarks)})


def play_search(inputs: Values) -> Played:
    """Find out whom several cameras agree on, among mistakes."""
    rng, values = np.random.default_rng(12), Values()
    for label, cameras in (("lab", ()), ("lenses", LENSED), ("one", LENSED[1:2])):
        rig = doors.Rig("lab", cameras)
        n_cameras = len(rig.cameras)
        for k in range(10):
            people, candidates, seen = draw_people(rng, 1 + k % 3), [], []
            for c in range(n_cameras):
                found = [_seen(rig, c, joints, rng) for joints in people]
                found = [each for each in found if np.isfinite(each[0]) and rng.random() < 0.85]
                found += [tuple(rng.uniform((0, 0, 60, -1), (1500, 900, 700, 1)))] * (k % 2)
                candidates.append([found[i] for i in rng.permutation(len(found))])
                seen += [(c, float(rng.random()), each) for each in found]
            proposed, left = doors.agree(rig, candidates)
            distinct = doors.keep_distinct(seen + seen[::2], n_cameras)
            kept = np.array([each for some in distinct for each in some]).reshape(-1, 4)
            named = {"left": np.array(left), "kept": np.array([len(some) for some in distinct])}
            named |= {"proposed": proposed, "windows": kept} if len(proposed) else {}
            values |= {f"{label} {k}/{name}": value for name, value in named.items()}
    return Played({name: value for name, value in values.items() if value.size})


def _seen(rig: doors.Rig, c: int, joints: Any, rng: np.random.Generator) -> Window:
    """Return the window of somebody whom a camera has found, a little off."""
    px, depth = doors.project_joints(rig, c, joints)
    x, y, side, turn = doors.window_round(rig, c, px, depth)
    off = rng.normal(0.0, 0.03, 3) * side
    return x + off[0], y + off[1], side * rng.choice([0.4, 0.8, 1.0, 1.2, 2.0]), turn


WALL = tuple(
    {"name": f"c{k}", "eye_m": eye, "target_m": (0.0, 2.2, 1.0), "field_deg": 60.0}
    for k, eye in enumerate(((2.9, 2.6, 2.4), (-2.9, 2.6, 2.4)))
)
"""Cameras that see a part of the floor."""


def play_coverage(inputs: Values) -> Played:
    """Find out which cameras would detect people on the floor of scenes and rigs."""
    values = Values()
    for place, name, cameras in (("lab", "own", ()), ("site", "own", ()), ("lab", "part", WALL),
                                 ("site", "near", NEIGHBOURS)):  # fmt: skip
        found = doors.Rig(place, cameras).cover_floor()
        values |= {f"{place} {name}/{key}": each for key, each in found.items()}
    return Played(values)


def play_crowd(inputs: Values) -> Played:
    """Find out whom searches show beside one worker: nobody, one or two people near or far, people
    in one camera alone, and the robot."""
    rng, rig, moments = np.random.default_rng(21), doors.Rig("lab"), []
    crowd = doors.Crowd(rig, 1)
    robot_m = np.array([[[-0.7, 0.0, 0.5], [-0.3, 0.1, 0.9]], [[-0.3, 0.1, 0.9], [0.1, 0.2, 0.8]]])
    for k in range(150):
        worker_m = np.array([1.2 + 0.3 * np.sin(k / 9), 0.8 * np.cos(k / 12), 0.9])
        people = [(worker_m, 0.9)]
        if 20 <= k < 60:
            people.append((np.array([-0.2 + 0.02 * k, -1.2 + 0.02 * k, 0.95]), 0.7))
        if 75 <= k < 100:
            people.append((worker_m + np.array([0.45, 0.3, 0.0]), 0.4))
        if 110 <= k < 118:
            people += [(np.array([0.2, 1.4, 0.9]), 1.0), (np.array([0.4, -1.4, 0.9]), 1.0)]
        shown = [[rng.random() < share for _, share in people] for _ in rig.cameras]
        if 64 <= k < 70:
            people, shown = [*people, (robot_m[0, 1], 1.0)], [[*each, True] for each in shown]
        found = [
            [_round_hips(rig, c, at, rng) for (at, _), is_shown in zip(people, row, strict=True)
             if is_shown]
            for c, row in enumerate(shown)
        ]  # fmt: skip
        if 100 <= k < 108 and k % 3 < 2:  # one camera alone
            found[1].append(_round_hips(rig, 1, np.array([-0.8, 0.7, 0.9]), rng))
        mine = [[row[0] if shows[0] else None for row, shows in zip(found, shown, strict=True)]]
        hips_m = worker_m[None] + rng.normal(0, 0.02, (1, 3))
        if k % 40 == 39:
            hips_m, mine = np.full((1, 3), np.nan), []
        known = None if k % 50 > 45 else robot_m
        moments.append(crowd.search(found, mine, hips_m, known, 1 + k % 5))
    return Played(stack(moments))


def _round_hips(rig: doors.Rig, c: int, hips_m: Any, rng: np.random.Generator) -> Any:
    """Return the window (x, y, side) of somebody upright with these hips, a little off."""
    described = rig.describe()
    at = described["projection"][c] @ np.append(hips_m, 1.0)
    side = 1.25 * 1.75 * 960.0 / at[2]
    x, y, side = np.append(at[:2] / at[2], side) + rng.normal(0, [4.0, 4.0, 10.0])
    return float(x), float(y), float(side)


def play_close(inputs: Values) -> Played:
    """Find out whom several cameras agree on who is near one of them, or behind it."""
    rng, values = np.random.default_rng(15), Values()
    for label, cameras in (("lab", ()), ("near each other", NEIGHBOURS)):
        rig, windows, counts = doors.Rig("lab", cameras), [], []
        n_cameras, described = len(rig.cameras), rig.describe()
        for k in range(40):
            c = k % n_cameras
            P, eye_m = described["projection"][c], described["eye_m"][c]
            ahead = P[2, :3] / np.linalg.norm(P[2, :3])
            depth_m = (0.15, 0.4, 0.6, 0.9, 0.98, 1.03, 1.3, 1.8, -0.4, -1.2)[k % 10]
            hips_m = eye_m + depth_m * ahead + rng.normal(0.0, 0.15 * abs(depth_m), 3)
            candidates = [[_seen_near(rig, i, hips_m, rng)] for i in range(n_cameras)]
            if k % 3 == 0:  # two see somebody else besides
                other_m = rng.uniform((0.0, -1.0, 0.8), (2.0, 1.0, 1.1))
                for i in ((c + 1) % n_cameras, (c + 2) % n_cameras):
                    candidates[i].append(_seen_near(rig, i, other_m, rng))
            proposed, left = doors.agree(rig, candidates)
            windows.append(
                np.nan_to_num(proposed[0] if len(proposed) else np.zeros((1, 4)), nan=-9)
            )
            counts.append([len(proposed), *left])
        shown = [each for each in windows if each.shape == (n_cameras, 4)]
        values |= {f"{label}/first": np.stack(shown), f"{label}/counts": np.array(counts)}
    return Played(values)


def _seen_near(
    rig: doors.Rig, c: int, hips_m: NDArray[np.float64], rng: np.random.Generator
) -> Window:
    """Return the window of somebody whose hips are there, also where a camera looks the other way,
    a little off."""
    P = rig.describe()["projection"][c]
    px, depth_m = doors.project_joints(rig, c, hips_m[None])
    focal_px = np.linalg.norm(np.cross(P[0, :3], P[2, :3]))
    side_px = rng.uniform(1.0, 3.7) * focal_px / abs(depth_m[0])
    x, y = px[0] + rng.normal(0.0, 0.02, 2) * side_px
    return float(x), float(y), float(side_px), 0.1


def play_searches(inputs: Values) -> Played:
    """Decide when images are searched, and where cameras look for two workers who go astray."""
    rng, rig, steps = np.random.default_rng(14), doors.Rig("lab"), []
    searches, people = doors.Searches(rig, n_workers=2, every=6), draw_people(rng, 3)
    for k in range(80):
        seen = [[_seen(rig, c, joints, rng) for joints in people] for c in range(4)]
        seen = [[each for each in found if np.isfinite(each[0])] for found in seen]
        has_image = (rng.random(4) < (0.9 if k % 20 < 15 else 0.3)).tolist()
        due = searches.tick(has_image)
        recent = searches.remember(due, [found[: k % 4] for found in seen])
        if k % 3 == 0:
            searches.rest()
        step = {"due": _flags(due), "recent": np.array([len(each) for each in recent])}
        for worker in range(2):
            shown = rng.random(4) < (0.8 if k % 30 < 8 else 0.02)
            blind = searches.count(worker, shown, has_image)
            expected = [found[worker] if len(found) > worker else None for found in seen]
            if blind:
                others = [[found[2] if len(found) > 2 else None for found in seen]]
                searches.learn(worker, seen, expected, others)
            away = [None if each is None else (each[0] + 40.0, *each[1:]) for each in expected]
            step |= {f"{worker}/blind": _flags(blind),
                     f"{worker}/windows": np.array(searches.look(worker, away))}  # fmt: skip
        if k == 50:
            searches.forget()
            searches.forget(1)
        steps.append(step)
    return Played(stack(steps))


def _flags(cameras: list[int]) -> NDArray[np.bool_]:
    return np.isin(np.arange(4), cameras)


def play_lenses(inputs: Values) -> Played:
    """Bring keypoints of images with lenses to pinhole pixels, and joints of another's function."""
    rig, rng = doors.Rig("lab", LENSED), np.random.default_rng(13)
    px = rng.uniform((-40.0, -40.0), (1960.0, 1120.0), (2, 3, 2, 15, 2))
    px[0, 1, 0, 3] = np.nan
    found = {"px": px, "confidence": rng.random((2, 3, 2, 15)),
             "sigma_px": rng.uniform(1.0, 30.0, (2, 3, 2, 15))}  # fmt: skip
    joints = np.column_stack([rng.uniform(0.0, 256.0, (15, 2)), rng.random(15)])
    joints[4, 0] = np.nan
    picture, window = np.zeros((256, 256, 3), np.uint8), (300.0, 200.0, 180.0, 0.4)
    own = doors.joints_by(lambda picture: joints, picture, window)
    return Played({**doors.to_pinhole(rig, found), "own": own})


# --- Images --------------------------------------------------------------------------------------


def mean_of_blocks(picture: NDArray[Any], n: int = 8) -> NDArray[np.float64]:
    """Return the means of an image (h, w, 3) over blocks of so many pixels, as shares of white."""
    h, w = (side // n for side in picture.shape[:2])
    blocks = np.asarray(picture[: h * n, : w * n], float).reshape(h, n, w, n, -1)
    return blocks.mean((1, 3)) / 255.0


def pattern(size_px: int) -> NDArray[np.uint8]:
    """Return a picture with edges and slopes of all colours."""
    row, column = np.indices((size_px, size_px)) / size_px
    waves = [np.sin(9.0 * column + 5.0 * row), np.cos(14.0 * row * column), np.sin(30.0 * row)]
    picture = np.round(127.5 + 120.0 * np.stack(waves, -1)).astype(np.uint8)
    picture[size_px // 3 : size_px // 2, size_px // 4 : size_px // 2] = (250, 20, 40)
    return picture


SPOILT: dict[str, tuple[float | None, ...]] = {
    "defocus": (None, 2.5), "noise": (None, 60.0), "dirt": (None, 0.6), "darkness": (None, 0.6),
    "white_balance": (None, -0.5), "exposure": (None, -1.5), "glare": (None, 0.3),
}  # fmt: skip


def play_images(inputs: Values) -> Played:
    """Sample, distort and spoil a picture."""
    rig, picture, values = doors.Rig("lab", LENSED), pattern(64), Values()
    views: tuple[Window, ...] = ((900.0, 500.0, 320.0, 0.3), (500.0, 700.0, 40.0, -1.0))
    for kind, amounts in SPOILT.items():
        spoilt = [
            doors.spoil_picture(rig, picture, view, kind, amount, (5, 1, 2, k))
            for k, amount in enumerate(amounts)
            for view in views
        ]
        values[kind] = np.stack([mean_of_blocks(each) for each in spoilt])
        values[f"{kind}/spread"] = np.stack(
            [each.astype(float).std((0, 1)) / 255 for each in spoilt]
        )
    room = cv2.resize(pattern(96), (160, 96))
    asked = ((80.0, 48.0, 60.0, 0.5), (10.0, 90.0, 90.0, -2.0), (150.0, 10.0, 30.0, 0.0))
    sampled = [mean_of_blocks(doors.sample_picture(room, window, 64)) for window in asked]
    tensor, whole = doors.feed_detector(room)
    values |= {
        "sampled": np.stack(sampled),
        "fed": tensor.reshape(28, 8, 28, 8, 3).mean((1, 3)),
        "fed whole": np.array([whole]) / 100.0,
        "fed landmarks": mean_of_blocks(doors.feed_landmarks(room) * 255.0),
    }
    drawn = doors.Drawn(partial(draw_light, 64), 64)
    bent: tuple[tuple[int, Window], ...] = (
        (0, (700.0, 500.0, 620.0, 0.4)), (0, (60.0, 540.0, 400.0, 0.0)),
        (0, (5e3, 540.0, 400.0, 0.0)), (1, (640.0, 100.0, 500.0, -0.8)),
        (1, (0.0, 0.0, 300.0, 2.5)), (2, (300.0, 700.0, 200.0, 1.0)),
    )  # fmt: skip
    seen = [mean_of_blocks(doors.view_through_lens(rig, drawn, c, window)) for c, window in bent]
    return Played({**values, "bent": np.stack(seen)})


def draw_light(size_px: int, view: Values) -> NDArray[np.uint8]:
    """Return a picture of the direction of the light: its colours are the ray's components."""
    middles = (np.arange(size_px) + 0.5) / size_px - 0.5
    x, y = np.meshgrid(middles, middles)
    cx, cy, side, turn = view["window"]
    c, s = np.cos(turn) * side, np.sin(turn) * side
    px = np.stack([c * x - s * y + cx, s * x + c * y + cy, np.ones_like(x)], -1)
    ray = px @ np.linalg.inv(view["intrinsics"]).T @ view["place"][:3, :3].T
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    return np.clip(np.round(ray * 127.0 + 127.0), 0, 255).astype(np.uint8)


def play_film(inputs: Values) -> Played:
    """Take images with open shutters and faults of a scene that moves."""
    cameras = (*LENSED[:2], {**LENSED[2], "exposure_s": 0.03})
    rig, rng, values = doors.Rig("lab", cameras), np.random.default_rng(14), Values()
    wrong = (
        {"kind": "motion_blur", "cameras": (0,), "until_s": 0.3},
        {"kind": "white_balance", "cameras": (1,), "amount": 0.3},
        {"kind": "exposure", "cameras": ("all",), "from_s": 0.2, "amount": -1.0},
    )
    drawn = doors.Drawn(partial(draw_light, 16), 16)
    film, taken = doors.Film(rig, drawn, wrong, 0.04), []
    for step in (1, 6, 12):
        now, before = (_scene(rng, rig) for _ in range(2))
        before["held"][1] = now["held"][1] + (step == 6)
        film.show(step, now, before, (0, 1, 2) if step != 6 else (0, 2), 5)
        taken += [film.take(c, (600.0, 400.0, 300.0, 0.2)) for c in range(3)]
    posed = [np.concatenate([np.ravel(value) for value in each.values()]) for each in drawn.poses]
    values["poses"] = np.stack(posed)
    return Played({**values, "taken": np.stack([mean_of_blocks(each) for each in taken])})


def _scene(rng: np.random.Generator, rig: doors.Rig) -> Values:
    turn, held = rng.standard_normal((1, 22, 4)), rng.standard_normal((3, 4))
    return {
        "q": rng.uniform(-1.0, 1.0, len(rig.home_q)),
        "position_m": rng.uniform(-1.0, 1.0, (1, 22, 3)),
        "turn": turn / np.linalg.norm(turn, axis=-1, keepdims=True),
        "held": np.array([1, 3, 0]) + rng.integers(0, 4, 3) * [0, 1, 0],
        "held_m": rng.uniform(-1.0, 1.0, (3, 3)),
        "held_turn": held / np.linalg.norm(held, axis=-1, keepdims=True),
    }


# --- The network on stored crops -----------------------------------------------------------------

N_MOMENTS, ROOM = 3, 1.5
"""Moments of which four cameras' crops are stored, so many times wider than the windows."""


def film_moments() -> Values:
    """Return a worker who works in the laboratory: segments, joints, what is held."""
    settings = {"near_probability": 0.4, "dwell_s": (2.0, 6.0)}
    crew = doors.Crew("lab", 1, 1, BODIES, "attentive", 5, settings=settings)
    moments = []
    for _ in range(N_MOMENTS):
        crew.go_on(0.05, 150)
        moved, names = crew.move(), ("position_m", "turn", "held", "held_m", "held_turn", "body")
        moments.append({name: moved[name][0] for name in names})
        moments[-1]["joints_m"] = crew.see()["joints_m"][0]
    return {
        name: value.astype(np.float32) if value.dtype.kind == "f" else value
        for name, value in stack(moments).items()
    }


def moment_at(film: Values, k: int) -> Values:
    """Return one moment in double precision, with the arm at rest."""
    return {
        name: value[k].astype(float) if value.dtype.kind == "f" else value[k]
        for name, value in film.items()
    }


def draw_crops() -> Values:
    """Return windows round a worker in four cameras at each moment, and crops round these."""
    film, rig = film_moments(), doors.Rig("lab")
    renderer, windows, crops = doors.Renderer(rig, 1, BODIES), [], Values()
    for k in range(N_MOMENTS):
        now = moment_at(film, k)
        renderer.pose({**now, "q": rig.home_q + 0.2 * k})
        for c in range(len(rig.cameras)):
            px, depth = doors.project_joints(rig, c, now["joints_m"][0])
            x, y, side, turn = doors.window_round(rig, c, px, depth)
            picture = renderer.draw(c, (x, y, ROOM * side, 0.0))
            ok, encoded = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 90])
            assert ok
            windows.append((x, y, side, turn))
            crops[f"crop/{k}{c}"] = encoded.ravel()
    renderer.close()
    return {"windows": np.array(windows).reshape(N_MOMENTS, -1, 4), **crops}


class Stored:
    """Images of four cameras of which only the stored crops are known; the rest is grey."""

    def __init__(self, inputs: Values, k: int) -> None:
        """Read the crops of a moment."""
        self.windows = inputs["windows"][k]
        n_cameras = len(self.windows)
        self._pictures = [
            cv2.imdecode(inputs[f"crop/{k}{c}"], cv2.IMREAD_COLOR)[..., ::-1].copy()
            for c in range(n_cameras)
        ]
        self.spoil: Callable[[NDArray[np.uint8]], NDArray[np.uint8]] = lambda picture: picture

    def crop(self, c: int, window: Window) -> NDArray[np.uint8]:
        """Return a window of a camera's image, (256, 256, 3)."""
        (x, y, side, _), picture = self.windows[c], self._pictures[c]
        scale = len(picture) / (ROOM * side)  # of stored pixels to the image's
        u, v, asked, turn = window
        per = asked / 256 * scale
        cos, sin = np.cos(turn) * per, np.sin(turn) * per
        middle = np.array([u - x, v - y]) * scale + len(picture) / 2
        linear = np.array([[cos, -sin], [sin, cos]])
        shift = middle - linear @ (127.5, 127.5) - 0.5
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        matrix = np.column_stack([linear, shift])
        border = {"borderMode": cv2.BORDER_CONSTANT, "borderValue": (128, 128, 128)}
        sampled = cv2.warpAffine(picture, matrix, (256, 256), flags=flags, **border)
        return self.spoil(sampled.astype(np.uint8))


def _tidied(seen: Values, sides: NDArray[np.float64]) -> Values:
    """Return keypoints in shares of the windows' sides, from their middles."""
    middles = np.nan_to_num(seen["windows"][:, :2])[:, None]
    return {
        "at": (seen["px"] - middles) / sides[:, None, None],
        "confidence": seen["confidence"],
        "log sigma": np.log(seen["sigma_px"] / sides[:, None]),
        "windows": seen["windows"] / np.append(sides.mean() * np.ones(3), 1.0),
    }


def play_crops(inputs: Values) -> Played:
    """Look at a worker through their windows, and through windows turned, shifted and enlarged."""
    rig, looks = doors.Rig("lab"), []
    for k in range(N_MOMENTS):
        stored = Stored(inputs, k)
        detector = doors.Detector(rig, stored.crop)
        off = np.random.default_rng([20, k]).normal(0.0, (0.05, 0.05, 0.08, 0.1), (4, 4))
        sides = stored.windows[:, 2]
        off[:, :3] *= sides[:, None]
        for wanted in (stored.windows, stored.windows + off):
            seen = detector.look([tuple(each) for each in wanted])
            looks.append(_tidied(seen, sides))
        detector.close()
    return Played(stack(looks))


def play_gates(inputs: Values) -> Played:
    """Look again and again while a window drifts away, at somebody half outside, in the dark."""
    rig, looks = doors.Rig("lab"), []
    stored = Stored(inputs, 0)
    sides = stored.windows[:, 2]
    detector = doors.Detector(rig, stored.crop, gate_every=4, max_offset=0.12)
    for step in range(7):
        drift = np.array([0.05, 0.02, 0.0, 0.0]) * step * sides[:, None]
        seen = detector.look([tuple(each) for each in stored.windows + drift], posture=(0.2,) * 5)
        looks.append(_tidied(seen, sides))
        if step == 4:
            detector.forget(0)
    detector.close()
    dark = doors.Detector(rig, stored.crop, min_presence=0.7, sure_presence=0.97)
    for share in (0.2, 0.05, 0.02):
        stored.spoil = partial(_darken, share)
        seen = dark.look([tuple(each) for each in stored.windows])
        looks.append(_tidied(seen, sides))
    dark.close()
    return Played(stack(looks))


def _darken(share: float, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.round(picture * share).astype(np.uint8)


def play_found(inputs: Values) -> Played:
    """Search whole images for somebody, and for nobody else."""
    rig, values = doors.Rig("lab"), Values()
    stored = Stored(inputs, 1)
    detector = doors.Detector(rig, stored.crop)
    sides, nowhere = stored.windows[:, 2], [None] * 4
    people = detector.search()
    values["counts"] = np.array([len(some) for some in people])
    found = detector.look(nowhere, 0, found=people)
    again = detector.look(nowhere, 1, [found["windows"].tolist()], found=people)
    values |= {f"found/{name}": value for name, value in _tidied(found, sides).items()}
    values["again/confidence"] = again["confidence"]
    detector.close()
    return Played(values)


def play_followed(inputs: Values) -> Played:
    """Follow a worker from image to image: found, at rest, elsewhere, out of sight, forgotten."""
    rig, steps, now = doors.Rig("lab"), [], [Stored(inputs, 0)]
    for estimator, n_workers in (("particle", 1), ("triangulation", 2)):
        follower = doors.Follower(
            rig, lambda c, window: now[0].crop(c, window), n_workers, estimator
        )
        for k, moment in enumerate((0, 0, 0, 0, 1, 1, 1, None, None, *[0] * 9)):
            if moment is None:
                now[0].spoil = partial(_darken, 0.0)
            else:
                now[0] = Stored(inputs, moment)
            if k == 9:
                follower.forget()
            belief = follower.update(0.08 if k == 3 else None, k)
            spread = np.sqrt(np.diagonal(belief.pop("cov_world"), axis1=-2, axis2=-1))
            parts = {**belief, "std_m": spread}
            steps.append({name: value[:, :1] for name, value in parts.items()})
        follower.close()
    return Played(stack(steps))


def play_nobody(inputs: Values) -> Played:
    """Look for people in images without any, until nobody is thought to be there; begin anew."""
    grey, steps = np.full((256, 256, 3), 128, np.uint8), []
    for n_workers in (1, 2):
        follower = doors.Follower(doors.Rig("lab"), lambda c, window: grey, n_workers, "particle")
        for k in range(40):
            if k == 30:
                follower.forget()
            belief = follower.update(0.3 if k > 25 else None, k)
            names = ("unknown", "blind_s", "tracked")
            steps.append({name: belief[name][:, 0] for name in names})
        follower.close()
    return Played(stack(steps))


# --- Drawn pictures ------------------------------------------------------------------------------


def play_drawn(inputs: Values) -> Played:
    """Draw what cameras see of a worker, through lenses as well, again with what was kept."""
    values: Values = {}
    for label, cameras in (("lab", ()), ("lenses", LENSED)):
        rig = doors.Rig("lab", cameras)
        renderer, pictures = doors.Renderer(rig, 1, BODIES), []
        for k in range(N_MOMENTS):
            now = moment_at(inputs, k)
            renderer.pose({**now, "q": rig.home_q + 0.2 * k})
            for c in range(len(rig.cameras)):
                size = rig.cameras[c].width_px, rig.cameras[c].height_px
                window = (size[0] / 2, size[1] / 2, 0.9 * min(size), 0.2 * c)
                pictures.append(mean_of_blocks(renderer.draw(c, window), 16))
        renderer.close()
        values[label] = np.stack(pictures)
    return Played(values)


def play_network(inputs: Values) -> Played:
    """Let the network look at the stored crops in every way."""
    parts = {"looks": play_crops, "gates": play_gates, "found": play_found}
    played = {label: part(inputs).values for label, part in parts.items()}
    return Played({f"{p}/{name}": v for p, each in played.items() for name, v in each.items()})


PROBES = (
    Probe(name="windows", play=play_windows, is_short=True),
    Probe(name="tensors", play=play_tensors, is_short=True),
    Probe(name="search", play=play_search, is_short=True),
    Probe(name="search_close", play=play_close, is_short=True),
    Probe(name="coverage", play=play_coverage, is_short=True),
    Probe(name="crowd", play=play_crowd, is_short=True),
    Probe(name="searches", play=play_searches, is_short=True),
    Probe(name="lenses", play=play_lenses, is_short=True),
    Probe(name="images", play=play_images, tolerance=IMAGE_TOLERANCE, is_short=True),
    Probe(name="film", play=play_film, is_short=True),
    Probe(name="network", play=play_network, inputs=draw_crops, tolerance=NETWORK_TOLERANCE,
          is_short=True),
    Probe(name="followed", play=play_followed, inputs=draw_crops, tolerance=FOLLOWED_TOLERANCE),
    Probe(name="followed_nobody", play=play_nobody),
    Probe(name="drawn", play=play_drawn, inputs=film_moments, tolerance=DRAWN_TOLERANCE,
          needs_pixels=True),
)  # fmt: skip
