"""Clips: one motion of one worker at a place in a scene, with the arm near its home posture."""

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
"""Time between the frames of a clip [s]: the environment's control step."""
N_FRAMES = 60
"""Number of frames of a clip."""
WARM_UP = 10
"""Number of first frames in which the tracker finds the worker; they are not evaluated."""
TRIES = 300
"""Number of places and moments that are tried; the one with the most room is taken."""

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
"""Scenes of the repertoire by family; motions that fold the body are the hardest to see."""
TIMES = {"fold": 4}
"""Number of times that motions of a family are played for each of the others (default 1): folded
bodies differ most from one another."""


Moved: TypeAlias = tuple[float, float]
"""Displacement of a camera rig: the share of the way along the walls to the next camera, and the
distance that the cameras are lowered [m]."""
AS_BUILT: Moved = (0.0, 0.0)
FIT_RIGS: tuple[Moved, ...] = (AS_BUILT, (0.5, 0.2), (0.75, 0.6))
"""Rigs of the fit's clips, in turn, because errors depend on the viewpoint."""
UNSEEN_RIG: Moved = (0.25, 0.4)
UNSEEN_SEEDS = 1003
"""Rig of the clips that no fit has used, and the offset of their seeds (which also changes the
pairs of motion and body)."""


@dataclass(frozen=True, slots=True)
class Clip:
    """Specification of a clip: motion, body, place and cameras."""

    scene: str
    """Key of `SCENES`."""
    motion: str
    """Key of `REPERTOIRE` or of `RECORDINGS`."""
    body: str
    """Name of a baked worker."""
    seed: int
    """Seed of the motion's details, the place and the arm."""
    rig: Moved = AS_BUILT
    """Displacement of the cameras."""
    draw: int = 0
    """Number of the draw of the emulator's errors, in clips that the emulator plays."""


@dataclass(frozen=True, slots=True)
class Staged:
    """A clip frame by frame."""

    q: JointAngles
    """Joint angles of the arm, which does not move, (N,) [rad]."""
    body: Body
    """Body of the worker."""
    motion: WorkerMotion
    """Motion of the worker, (T, 1, ...)."""


def find_family(motion: str) -> str:
    """Return the family of a scene of the repertoire, or "recorded"."""
    families = (family for family, motions in FAMILIES.items() if motion in motions)
    return next(families, "recorded")


def list_fit_clips(rounds: int, seed: int) -> list[Clip]:
    """Return the clips that the emulator is fitted to (`list_clips`)."""
    return list_clips(rounds, seed, FIT_RIGS)


def list_unseen_clips(rounds: int, seed: int) -> list[Clip]:
    """Return as many clips again with other seeds, other pairs of motion and body, and displaced
    cameras."""
    return list_clips(rounds, seed + UNSEEN_SEEDS, (UNSEEN_RIG,))


def list_recorded_clips(role: Role, rounds: int, seed: int, rigs: Sequence[Moved]) -> list[Clip]:
    """Return the clips of recordings of people with a role, in both scenes (`list_clips`)."""
    names = [name for name, of in RECORDINGS.items() if of == role]
    return list_clips(rounds, seed, rigs, motions=names)


def list_clips(
    rounds: int,
    seed: int,
    rigs: Sequence[Moved],
    bodies: Sequence[str] = worker_names(),
    motions: Sequence[str] = tuple(REPERTOIRE),
    scenes: Sequence[str] = tuple(SCENES),
) -> list[Clip]:
    """Return every motion, `rounds` times in each scene, or (0 rounds) in one; bodies and rigs in
    turn."""
    clips = []
    for k, motion in enumerate(motions):
        for round_ in range(max(rounds, 1) * TIMES.get(find_family(motion), 1)):
            for i, scene in enumerate(scenes):
                if rounds == 0 and i != (k + round_) % len(scenes):
                    continue
                body = bodies[(3 * k + 5 * i + 2 * round_ + seed) % len(bodies)]
                rig = rigs[(round_ + k) % len(rigs)]
                clips.append(Clip(scene, motion, body, seed + round_, rig))
    return sorted(clips, key=lambda clip: (clip.scene, clip.body, clip.rig))


def load_scene(clip: Clip) -> Scene:
    """Return the compiled scene of a clip."""
    rig = () if clip.rig == AS_BUILT else displace(SCENES[clip.scene].cameras, clip.rig)
    return build(SceneConfig(cameras=rig), clip.scene, 1, clip.body)


def displace(rig: tuple[CameraConfig, ...], how: Moved) -> tuple[CameraConfig, ...]:
    """Return the cameras of a rig after a displacement."""
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


def make_number(clip: Clip) -> int:
    """Return a clip's number, which its draw of the errors does not change."""
    words = f"{clip.seed} {clip.scene} {clip.motion} {clip.body} {clip.rig}"
    return zlib.crc32(words.encode())


def stage(clip: Clip, scene: Scene) -> Staged:
    """Place the worker where there is room, at a moment of the motion that the seed chooses."""
    rng = np.random.default_rng(make_number(clip))
    seed, body = int(rng.integers(2**31)), load_body(clip.body)
    path = _play(clip.motion, body, seed).position_world[:, 0, 0, :2]
    xy_m, yaw_rad, first = _place(path, scene, rng)
    motion = _play(clip.motion, body, seed, xy_m, yaw_rad)
    frames = np.minimum(first + np.arange(N_FRAMES), len(path) - 1)
    motion = rows(motion, frames)
    spread = np.array(scene.robot.spread_rad)
    q = scene.home_q + rng.uniform(-1, 1, len(spread)) * spread
    return Staged(q, body, motion)


def _play(
    name: str, body: Body, seed: int, xy_m: tuple[float, float] = (0.0, 0.0), yaw_rad: float = 0.0
) -> WorkerMotion:
    """Return a complete scene of the repertoire, or a recording, (T, 1, ...), that begins at a
    place."""
    if name not in REPERTOIRE:
        return perform_clip(recording(name), body, DT_S, xy_m, yaw_rad, N_FRAMES * DT_S)
    me = make_worker(body, xy_m, yaw_rad, right=seed % 5 > 0)
    films = perform(REPERTOIRE[name], me, np.random.default_rng(seed), DT_S)
    return _join(films)


def _join(films: list[Film]) -> WorkerMotion:
    """Return several films as one motion, in their order."""
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
    """Return the start of a path (T, 2) [m] at which these frames have room: position, yaw,
    frame."""
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
