"""Clips: one motion of one worker somewhere in a scene, with the arm somewhere near home."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from assets.emulator.recorded import RECORDINGS, Role, perform_clip, recording
from hrc_env.config import HRCConfig
from hrc_env.core.batching import rows
from hrc_env.core.records import Held, WorkerMotion
from hrc_env.core.typing import Floats, JointAngles
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.motion.floorplan import BODY_M, STAND_M, make_floorplan, read_slack
from hrc_env.motion.repertoire import REPERTOIRE, Film, make_worker, perform
from hrc_env.scene.build import SCENES, Scene, SceneConfig, build
from hrc_env.worker.body import Body, load_body, worker_names

DT_S = 0.04
"""Between the frames of a clip [s]: the environment's control step."""
N_FRAMES = 60
"""Frames of a clip."""
WARM_UP = 10
"""The first of these are for finding the worker and do not count."""
TRIES = 300
"""Places and moments that are tried; the one with the most room is taken."""

NEAR_M = 5.0
"""Greatest distance of places from the middle of the working area [m]: the tracker does not follow
workers that are 4 standard deviations of its prior (6 m) away."""

FAMILIES: dict[str, tuple[str, ...]] = {
    "stand": ("stand", "look round", "point", "measure", "turn"),
    "walk": (
        "walk 0.8 m/s", "walk 1.1 m/s", "walk 1.3 m/s", "walk 1.4 m/s", "walk 1.8 m/s",
        "step back", "stumble",
    ),
    "carry": (
        "box from the floor to a table", "board in both hands", "board on the shoulder",
        "receive and hand over", "cart", "wheelbarrow",
    ),
    "work": (
        "hammer lightly", "hammer on a table", "hammer at a wall", "drill", "drill overhead",
        "saw", "climb",
    ),
    "fold": ("squat", "kneel", "lunge", "hammer on the floor"),
}  # fmt: skip
"""The scenes of the repertoire by family: what folds the body is hardest to see."""
TIMES = {"fold": 4}
"""Families, and the factor by which they are played more often: folded bodies differ most from one
another."""


Moved: TypeAlias = tuple[float, float]
"""A rig whose cameras hang elsewhere: this share of the way along the walls to the next one, and so
much lower [m]."""
AS_BUILT: Moved = (0.0, 0.0)
FIT_RIGS: tuple[Moved, ...] = (AS_BUILT, (0.5, 0.2), (0.75, 0.6))
"""Of the fit's clips, in turns: errors depend on from where one looks."""
UNSEEN_RIG: Moved = (0.25, 0.4)
UNSEEN_SEEDS = 1003
"""Of clips that no fit has seen: rig, and how much higher their seeds are (which also pairs motions
and bodies otherwise)."""


@dataclass(frozen=True, slots=True)
class Clip:
    """What is played where."""

    scene: str
    """A key of `SCENES`."""
    motion: str
    """A key of `REPERTOIRE`, or of `RECORDINGS`."""
    body: str
    """A baked worker."""
    seed: int
    """Of the motion's details, the place and the arm."""
    rig: Moved = AS_BUILT
    """Where the cameras hang."""
    draw: int = 0
    """Number of the errors' draw, where they are drawn."""


@dataclass(frozen=True, slots=True)
class Staged:
    """A clip, frame by frame."""

    q: JointAngles
    """(N,) the arm, which stands still [rad]."""
    body: Body
    """The worker's."""
    motion: WorkerMotion
    """(T, 1, ...)."""


def family_of(motion: str) -> str:
    """The family of a scene of the repertoire, or "recorded"."""
    families = (family for family, motions in FAMILIES.items() if motion in motions)
    return next(families, "recorded")


def fit_clips(rounds: int, seed: int) -> list[Clip]:
    """Those that the emulator is fitted to (`clips_of`)."""
    return clips_of(rounds, seed, FIT_RIGS)


def unseen_clips(rounds: int, seed: int) -> list[Clip]:
    """As many others: other seeds and pairs of motion and body, cameras elsewhere."""
    return clips_of(rounds, seed + UNSEEN_SEEDS, (UNSEEN_RIG,))


def recorded_clips(role: Role, rounds: int, seed: int, rigs: Sequence[Moved]) -> list[Clip]:
    """Recordings of people that serve for this, in both scenes (`clips_of`)."""
    names = [name for name, of in RECORDINGS.items() if of == role]
    return clips_of(rounds, seed, rigs, motions=names)


def clips_of(
    rounds: int,
    seed: int,
    rigs: Sequence[Moved],
    bodies: Sequence[str] = worker_names(),
    motions: Sequence[str] = tuple(REPERTOIRE),
    scenes: Sequence[str] = tuple(SCENES),
) -> list[Clip]:
    """Every motion, `rounds` times in each scene, or (0 rounds) in one; bodies and rigs in turn."""
    clips = []
    for k, motion in enumerate(motions):
        for round_ in range(max(rounds, 1) * TIMES.get(family_of(motion), 1)):
            for i, scene in enumerate(scenes):
                if rounds == 0 and i != (k + round_) % len(scenes):
                    continue
                body = bodies[(3 * k + 5 * i + 2 * round_ + seed) % len(bodies)]
                rig = rigs[(round_ + k) % len(rigs)]
                clips.append(Clip(scene, motion, body, seed + round_, rig))
    return sorted(clips, key=lambda clip: (clip.scene, clip.body, clip.rig))


def scene_of(clip: Clip) -> Scene:
    """The compiled scene of a clip."""
    rig = () if clip.rig == AS_BUILT else moved(SCENES[clip.scene].cameras, clip.rig)
    return build(SceneConfig(cameras=rig), clip.scene, 1, clip.body)


def moved(rig: tuple[CameraConfig, ...], how: Moved) -> tuple[CameraConfig, ...]:
    """The same cameras elsewhere."""
    along, lower_m = how
    eyes = [camera.eye_world for camera in rig]
    following = eyes[1:] + eyes[:1]
    places = [
        (a[0] + along * (b[0] - a[0]), a[1] + along * (b[1] - a[1]), a[2] - lower_m)
        for a, b in zip(eyes, following, strict=True)
    ]
    return tuple(
        CameraConfig(camera.name, place, camera.target_world, camera.hfov_deg)
        for camera, place in zip(rig, places, strict=True)
    )


def number_of(clip: Clip) -> int:
    """A number of its own, however often it is drawn."""
    words = f"{clip.seed} {clip.scene} {clip.motion} {clip.body} {clip.rig}"
    return zlib.crc32(words.encode())


def stage(clip: Clip, scene: Scene) -> Staged:
    """The worker at a place with room, at a moment of the motion that the seed chooses."""
    rng = np.random.default_rng(number_of(clip))
    seed, body = int(rng.integers(2**31)), load_body(clip.body)
    path = _played(clip.motion, body, seed).position_world[:, 0, 0, :2]
    xy_m, yaw_rad, first = _place(path, scene, rng)
    motion = _played(clip.motion, body, seed, xy_m, yaw_rad)
    frames = np.minimum(first + np.arange(N_FRAMES), len(path) - 1)
    motion = rows(motion, frames)
    spread = np.array(scene.robot.spread_rad)
    q = scene.home_q + rng.uniform(-1, 1, len(spread)) * spread
    return Staged(q, body, motion)


def _played(
    name: str, body: Body, seed: int, xy_m: tuple[float, float] = (0.0, 0.0), yaw_rad: float = 0.0
) -> WorkerMotion:
    """A whole scene of the repertoire, or a recording (T, 1, ...), begun at a place."""
    if name not in REPERTOIRE:
        return perform_clip(recording(name), body, DT_S, xy_m, yaw_rad, N_FRAMES * DT_S)
    me = make_worker(body, xy_m, yaw_rad, right=seed % 5 > 0)
    films = perform(REPERTOIRE[name], me, np.random.default_rng(seed), DT_S)
    return _joined(films)


def _joined(films: list[Film]) -> WorkerMotion:
    """One film after the other."""
    motions = [film.motion for film in films]
    helds = [motion.held for motion in motions if motion.held is not None]
    return WorkerMotion(
        np.concatenate([motion.position_world for motion in motions]),
        np.concatenate([motion.quaternion_wxyz for motion in motions]),
        np.concatenate([motion.velocity_world for motion in motions]),
        np.concatenate([motion.angular_velocity_world for motion in motions]),
        Held(
            np.concatenate([held.kind for held in helds]),
            np.concatenate([held.position_world for held in helds]),
            np.concatenate([held.quaternion_wxyz for held in helds]),
        ),
    )


def _place(
    path: Floats, scene: Scene, rng: np.random.Generator
) -> tuple[tuple[float, float], float, int]:
    """Where to begin so that these frames of a path (T, 2) [m] have room: place, yaw, frame."""
    plan, grounds = make_floorplan(scene.grounds), scene.grounds
    last = max(len(path) - N_FRAMES, 0)
    middle_of_work = HRCConfig().tracker.prior_mean_world[:2]
    corners = np.array([grounds.walkable_x_m, grounds.walkable_y_m]).T
    best, most = ((0.0, 0.0), 0.0, 0), -np.inf
    for _ in range(TRIES):
        first, yaw = int(rng.integers(last + 1)), float(rng.uniform(-np.pi, np.pi))
        middle = rng.uniform(*corners)
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        part = path[first : first + N_FRAMES : 10] @ turn.T
        begin = middle - part.mean(0)
        room = min(read_slack(x, y, plan.grid) for x, y in part + begin)
        room = min(room, NEAR_M - float(np.hypot(*(part + begin - middle_of_work).T).max()))
        if room > most:
            best, most = ((float(begin[0]), float(begin[1])), yaw, first), room
        if room >= STAND_M - BODY_M:
            break
    return best
