"""Buffers of the last frames of every camera, and sets of frames that were taken together."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from hrc_env.core.batching import map_arrays, write_rows
from hrc_env.core.records import Keypoints
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints

SAME_S = 5e-5
"""Maximum difference between two times that are considered equal [s]."""
_TICK_S = 1e-4
"""Resolution of times within a control step [s]; environments with equal times share a
computation."""
_TOGETHER_TICKS = 20
"""Maximum difference in time between frames of one set, in ticks. It is 2 ms, in which a walking
person moves 3 mm."""
_END = 2**40
"""Tick that stands for the end of the step."""
_NEVER = 2**41
"""Tick of a frame that was not taken within the step."""
_HELD_S = 0.1
"""Maximum age of a frame that is reused with a newer frame of another camera [s]."""
_DRIFT_PX_S = 300.0
"""Speed of a walking person in the image, which is the growth rate of the standard deviation of
detections in a reused frame [px/s]."""


class Frames(NamedTuple):
    """The last N frames of each camera in each environment, in ring buffers changed in place."""

    keypoints: Keypoints
    """(B, C, N, W, J, ...) keypoints of the frames."""
    time_s: Floats
    """(B, C, N) times at which the frames were taken [s]; NaN where there is no frame."""
    n_taken: Ints
    """(B, C) number of frames stored since the reset."""
    newest_s: Floats
    """(B, C) time of the camera's newest frame [s]."""
    forgotten_s: Floats
    """(B,) time of the newest frame that was overwritten [s]."""


class FrameSet(NamedTuple):
    """Frames of several cameras taken at the same time, for G environments."""

    keypoints: Keypoints
    """(G, C, W, J, ...) keypoints; missing where a camera has no frame."""
    has: Bools
    """(G, C) mask of the cameras with a frame in the set."""
    at_s: Floats
    """(G,) time of the frames [s]."""


class TimedFrameSet(NamedTuple):
    """A set of frames with its time relative to the control step."""

    since_s: float
    """Time from the beginning of the step to the frames [s]."""
    frames: FrameSet
    """The frames."""


class StepFrames(NamedTuple):
    """The frames of one control step, for environments in which they have equal times."""

    members: Ints
    """(M,) positions of these environments in the argument `ids` of `group_frames`."""
    step_s: float
    """Length of the step [s]."""
    frame_sets: list[TimedFrameSet]
    """The sets of frames in chronological order."""


class Span(NamedTuple):
    """The interval of ticks that one set of frames covers."""

    first: int
    """Tick of the first frame."""
    last: int
    """Tick of the last frame."""


def make_frames(batch: int, n_cameras: int, n_frames: int, n_workers: int) -> Frames:
    """Return empty ring buffers for the frames of every camera.

    Args:
        batch: number of environments B.
        n_cameras: number of cameras C.
        n_frames: number of frames N stored for each camera.
        n_workers: number of workers W.
    """
    shape = (batch, n_cameras, n_frames, n_workers, N_JOINTS)
    return Frames(
        keypoints=Keypoints(np.full((*shape, 2), np.nan), np.zeros(shape), np.full(shape, np.inf)),
        time_s=np.full(shape[:3], np.nan),
        n_taken=np.zeros(shape[:2], np.int64),
        newest_s=np.full(shape[:2], -np.inf),
        forgotten_s=np.full(batch, -np.inf),
    )


def forget_frames(frames: Frames, ids: Ints) -> None:
    """Discard the frames of environments `ids`."""
    frames.time_s[ids], frames.n_taken[ids] = np.nan, 0
    frames.newest_s[ids], frames.forgotten_s[ids] = -np.inf, -np.inf


def remember(frames: Frames, keypoints: Keypoints, time_s: Floats, use: Bools) -> None:
    """Replace the oldest stored frames by new ones.

    Args:
        frames: the ring buffers, changed in place.
        keypoints: (B, C, W, J, ...) keypoints of one frame from each camera.
        time_s: (B, C) times at which the frames were taken [s].
        use: (B, C) mask of the frames to store.
    """
    b, c = np.nonzero(use)
    n = frames.n_taken[b, c] % frames.time_s.shape[2]
    old_s = frames.time_s[b, c, n]
    np.maximum.at(frames.forgotten_s, b, np.where(np.isfinite(old_s), old_s, -np.inf))
    write_rows(frames.keypoints, (b, c, n), map_arrays(keypoints, lambda array: array[b, c]))
    frames.time_s[b, c, n] = frames.newest_s[b, c] = time_s[b, c]
    frames.n_taken[b, c] += 1


def group_frames(frames: Frames, ids: Ints, end_s: Floats, step_s: Floats) -> Iterator[StepFrames]:
    """Yield the frames of one control step for each group of environments with equal times.

    Args:
        frames: the stored frames.
        ids: (G,) indices of the environments.
        end_s: (G,) times at which the environments' steps ended [s].
        step_s: (G,) lengths of the steps [s].
    """
    ticks = _count_ticks(frames.time_s[ids], end_s, step_s)
    times = np.sort(ticks.reshape(len(ids), -1), axis=1)
    times = times[:, : int((times < _NEVER).sum(1).max(initial=0))]
    for members in _group_equal_rows(np.column_stack([step_s.view(np.int64), times])):
        step = float(step_s[members[0]])
        begin_s = end_s[members] - step
        frame_sets: list[TimedFrameSet] = []
        for first, last in _find_spans(times[members[0]]):
            at_s = step if last == _END else float(last) * _TICK_S
            inside = (ticks[members] >= first) & (ticks[members] <= last)
            newest = _select_newest(frames, ids[members], inside, begin_s + at_s)
            frame_sets.append(TimedFrameSet(at_s, newest))
        yield StepFrames(members, step, frame_sets)


def add_held_frames(frames: Frames, ids: Ints, frame_set: FrameSet, wanted: Bools) -> Keypoints:
    """Return the keypoints of a set, completed with other cameras' last frames for some workers.

    Two views that are slightly out of synchronisation locate a worker better than one view alone.
    The standard deviations of detections in an older frame grow by the distance that a walking
    person may have moved in the image.

    Args:
        frames: the stored frames.
        ids: (G,) indices of the environments.
        frame_set: the set of frames.
        wanted: (G, W) mask of the workers that need the frames of other cameras.
    """
    age_s = frame_set.at_s[:, None, None] - frames.time_s[ids]
    recent = (age_s > -SAME_S) & (age_s < _HELD_S) & ~frame_set.has[:, :, None]
    held = _select_newest(frames, ids, recent, frame_set.at_s)
    youngest_s = np.where(recent, age_s, np.inf).min(2)
    drift_px = _DRIFT_PX_S * np.where(held.has, youngest_s, 0.0)
    sigma_px = np.hypot(held.keypoints.sigma_px, drift_px[:, :, None, None])
    use, shown = (held.has[:, :, None] & wanted[:, None])[..., None], frame_set.keypoints
    return Keypoints(
        np.where(use[..., None], held.keypoints.px, shown.px),
        np.where(use, held.keypoints.confidence, shown.confidence),
        np.where(use, sigma_px, shown.sigma_px),
    )


def drop_cameras(keypoints: Keypoints, missing: Bools) -> Keypoints:
    """Return keypoints in which those of cameras `missing` (B, C) are marked as missing."""
    gone = missing[:, :, None, None]
    return Keypoints(
        np.where(gone[..., None], np.nan, keypoints.px),
        np.where(gone, 0.0, keypoints.confidence),
        np.where(gone, np.inf, keypoints.sigma_px),
    )


def has_detections(keypoints: Keypoints) -> Bools:
    """Return a mask (B, C) of the cameras with any detection in their frame."""
    return np.any(np.isfinite(keypoints.px[..., 0]) & (keypoints.confidence > 0), axis=(2, 3))


def _count_ticks(time_s: Floats, end_s: Floats, step_s: Floats) -> Ints:
    """Return the ticks (G, C, N) from the beginning of the step to each frame.

    The value is `_END` for frames at the end of the step and `_NEVER` for frames outside the step.

    Args:
        time_s: (G, C, N) times of the frames [s].
        end_s: (G,) times at which the steps ended [s].
        step_s: (G,) lengths of the steps [s].
    """
    since_s = time_s - (end_s - step_s)[:, None, None]
    step_s = step_s[:, None, None]
    inside = (since_s > SAME_S) & (since_s <= step_s + SAME_S)
    ticks = np.rint(np.where(inside, since_s, 0.0) / _TICK_S).astype(np.int64)
    ticks = np.where(since_s >= step_s - SAME_S, _END, np.maximum(ticks, 1))
    return np.where(inside, ticks, _NEVER)


def _group_equal_rows(keys: Ints) -> Iterator[Ints]:
    """Yield, for each group of equal rows of `keys` (G, n), the indices of its rows."""
    if (keys == keys[0]).all():
        yield np.arange(len(keys))
        return
    _, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.reshape(-1)
    for k in range(int(group.max()) + 1):
        yield np.flatnonzero(group == k)


def _find_spans(times: Ints) -> list[Span]:
    """Group sorted ticks (n,) into sets, and return the first and the last tick of each set."""
    spans: list[Span] = []
    for tick in map(int, times[times < _NEVER]):
        if spans and tick - spans[-1].first <= _TOGETHER_TICKS:
            spans[-1] = Span(spans[-1].first, tick)
        else:
            spans.append(Span(tick, tick))
    return spans


def _select_newest(frames: Frames, ids: Ints, among: Bools, at_s: Floats) -> FrameSet:
    """Return the newest of the given frames of each camera as a set.

    Args:
        frames: the stored frames.
        ids: (G,) indices of the environments.
        among: (G, C, N) mask of the frames that may be selected.
        at_s: (G,) time of the set [s].
    """
    n = np.where(among, frames.time_s[ids], -np.inf).argmax(2)
    b, c = ids[:, None], np.arange(n.shape[1], dtype=np.int64)
    keypoints = map_arrays(frames.keypoints, lambda array: array[b, c, n])
    has = np.asarray(among.any(2))
    return FrameSet(keypoints if has.all() else drop_cameras(keypoints, ~has), has, at_s)
