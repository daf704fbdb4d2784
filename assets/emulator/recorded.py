"""Recordings of people as motions of the emulator's clips, beside those of the repertoire."""

import functools

import numpy as np

from assets.recordings.clips import CLIPS, Role, clips_of
from assets.recordings.synthetic import STYLES, make_clips
from hrc_env.core.records import WorkerMotion
from hrc_env.core.typing import Floats
from hrc_env.mocap.poses import pose_segments
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import measure_body
from hrc_env.motion.clip import Clip, scale_clip
from hrc_env.worker.body import Body

RECORDINGS: dict[str, Role] = {each.name: each.role for each in (*CLIPS, *STYLES)}
"""Role of each recording by its name: to fit, or to validate."""


MADE = tuple(style.name for style in STYLES)
"""Names of synthetic recordings."""


def recording(name: str) -> Clip:
    """Return a recording by its name; missing recordings of people are downloaded."""
    return (_made if name in MADE else _of_people)(RECORDINGS[name])[name]


@functools.cache
def _of_people(role: Role) -> dict[str, Clip]:
    return {each.name: clip for each, clip, _ in clips_of(role)}


@functools.cache
def _made(role: Role) -> dict[str, Clip]:
    return {each.name: clip for each, clip, _ in make_clips(role)}


def perform_clip(
    clip: Clip, body: Body, dt_s: float, xy_m: tuple[float, float], yaw_rad: float, least_s: float
) -> WorkerMotion:
    """Return a recording (T, 1, ...) as played by a body that begins at a place, without angular
    velocities.

    One that is shorter than `least_s` is played forwards and backwards, never faster than recorded.
    """
    bones = measure_body(body)
    q = _placed(scale_clip(clip, bones.lengths), xy_m, yaw_rad)
    moments_s = _moments(len(q) / clip.fps, least_s, dt_s)
    frames = np.minimum(moments_s * clip.fps, len(q) - 1.0)
    q = np.stack([np.interp(frames, np.arange(len(q)), column) for column in q.T], -1)
    position, turn, _ = pose_segments(q, bones)
    velocity = np.gradient(position, dt_s, axis=0)
    still = np.zeros_like(velocity)
    return WorkerMotion(position[:, None], turn[:, None], velocity[:, None], still[:, None])


def _moments(lasts_s: float, least_s: float, dt_s: float) -> Floats:
    """Return times of a recording, one for each frame, (T,) [s]."""
    if lasts_s >= least_s:
        return np.arange(0.0, lasts_s, dt_s)
    time_s = np.arange(0.0, least_s, dt_s)
    return 0.5 * lasts_s * (1.0 - np.cos(2.0 * time_s / lasts_s))


def _placed(controls: Floats, xy_m: tuple[float, float], yaw_rad: float) -> Floats:
    """Return control vectors of a clip that begins at a place, (T, N_CONTROLS)."""
    out, cos, sin = controls.copy(), np.cos(yaw_rad), np.sin(yaw_rad)
    turn = np.array([[cos, sin], [-sin, cos]])
    for at in (c.ROOT_X, c.ANKLE, c.ANKLE + 6):
        out[:, [at, at + 1]] = controls[:, [at, at + 1]] @ turn + xy_m
    for at in (c.HEADING, c.ANKLE + 3, c.ANKLE + 9):
        out[:, at] += yaw_rad
    return out
