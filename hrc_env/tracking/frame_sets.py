"""The last frames of every camera with their times, and which of them belong together."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from hrc_env.core.batching import mapped, write_rows
from hrc_env.core.records import Keypoints
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints

SAME_S = 5e-5
"""Times that differ by no more are the same."""
_TICK_S = 1e-4
"""Times within a control step are taken to this, so that equal latencies share a computation."""
_TOGETHER_TICKS = 20
"""Frames within 2 ms are of one set: at walking speed, less than 3 mm."""
_END, _NEVER = 2**40, 2**41
"""Ticks of a frame at the end of its step, and of one that is not within it."""
_HELD_S = 0.1
"""A frame may be shown beside one that is so much newer, where two views are needed."""
_DRIFT_PX_S = 300.0
"""How fast a walker's pixels move: what a held frame's detections lose in worth."""


class Frames(NamedTuple):
    """N frames of each camera of each environment, a ring; arrays changed in place."""

    keypoints: Keypoints
    """(B, C, N, W, J, ...)."""
    time_s: Floats
    """(B, C, N) when they were taken [s]; NaN: no frame."""
    n_taken: Ints
    """(B, C) frames that were taken in."""
    newest_s: Floats
    """(B, C) time of the newest [s]."""
    forgotten_s: Floats
    """(B,) time of the newest frame that was overwritten [s]."""


class FrameSet(NamedTuple):
    """Frames of one time in G environments."""

    keypoints: Keypoints
    """(G, C, W, J, ...), missing where a camera has no frame."""
    has: Bools
    """(G, C) whether it has."""
    at_s: Floats
    """(G,) the time."""


def make_frames(batch: int, n_cameras: int, n_frames: int, n_workers: int) -> Frames:
    """Room for frames, and none yet."""
    shape = (batch, n_cameras, n_frames, n_workers, N_JOINTS)
    return Frames(
        keypoints=Keypoints(np.full((*shape, 2), np.nan), np.zeros(shape), np.full(shape, np.inf)),
        time_s=np.full(shape[:3], np.nan),
        n_taken=np.zeros(shape[:2], np.int64),
        newest_s=np.full(shape[:2], -np.inf),
        forgotten_s=np.full(batch, -np.inf),
    )


def forget_frames(frames: Frames, ids: Ints) -> None:
    """Environments `ids` have seen nothing."""
    frames.time_s[ids], frames.n_taken[ids] = np.nan, 0
    frames.newest_s[ids], frames.forgotten_s[ids] = -np.inf, -np.inf


def remember(frames: Frames, keypoints: Keypoints, time_s: Floats, use: Bools) -> None:
    """Keep the frames `use` (B, C) of times (B, C); the oldest ones make room."""
    b, c = np.nonzero(use)
    n = frames.n_taken[b, c] % frames.time_s.shape[2]
    old_s = frames.time_s[b, c, n]
    np.maximum.at(frames.forgotten_s, b, np.where(np.isfinite(old_s), old_s, -np.inf))
    write_rows(frames.keypoints, (b, c, n), mapped(keypoints, lambda array: array[b, c]))
    frames.time_s[b, c, n] = frames.newest_s[b, c] = time_s[b, c]
    frames.n_taken[b, c] += 1


def frame_sets_of(
    frames: Frames, ids: Ints, end_s: Floats, step_s: Floats
) -> Iterator[tuple[Ints, float, list[tuple[float, FrameSet]]]]:
    """What was seen in a step of environments `ids` (G,) that ended at `end_s` and was `step_s`
    (G,) long, by groups with equal times: members (M,) of `ids`; the step [s]; and its frame sets
    in order of time, each with the time since the step began [s]."""
    ticks = _ticks(frames.time_s[ids], end_s, step_s)
    times = np.sort(ticks.reshape(len(ids), -1), axis=1)
    times = times[:, : int((times < _NEVER).sum(1).max(initial=0))]
    for members in _alike(np.column_stack([step_s.view(np.int64), times])):
        step = float(step_s[members[0]])
        begin_s = end_s[members] - step
        frame_sets = []
        for first, last in _spans(times[members[0]]):
            at_s = step if last == _END else float(last) * _TICK_S
            inside = (ticks[members] >= first) & (ticks[members] <= last)
            frame_sets.append((at_s, _frame_set(frames, ids[members], inside, begin_s + at_s)))
        yield members, step, frame_sets


def beside(frames: Frames, ids: Ints, frame_set: FrameSet, wanted: Bools) -> Keypoints:
    """The frames of a set, and the other cameras' last ones for the workers `wanted` (G, W).

    Two views that are a little out of step say where somebody is better than one alone does.
    Detections of a held frame are told as less certain, by how far a walker may have come.
    """
    age_s = frame_set.at_s[:, None, None] - frames.time_s[ids]
    recent = (age_s > -SAME_S) & (age_s < _HELD_S) & ~frame_set.has[:, :, None]
    held = _frame_set(frames, ids, recent, frame_set.at_s)
    youngest_s = np.where(recent, age_s, np.inf).min(2)
    drift_px = _DRIFT_PX_S * np.where(held.has, youngest_s, 0.0)
    sigma_px = np.hypot(held.keypoints.sigma_px, drift_px[:, :, None, None])
    use, shown = (held.has[:, :, None] & wanted[:, None])[..., None], frame_set.keypoints
    return Keypoints(
        np.where(use[..., None], held.keypoints.px, shown.px),
        np.where(use, held.keypoints.confidence, shown.confidence),
        np.where(use, sigma_px, shown.sigma_px),
    )


def without(keypoints: Keypoints, missing: Bools) -> Keypoints:
    """Keypoints without the frames of cameras `missing` (B, C)."""
    gone = missing[:, :, None, None]
    return Keypoints(
        np.where(gone[..., None], np.nan, keypoints.px),
        np.where(gone, 0.0, keypoints.confidence),
        np.where(gone, np.inf, keypoints.sigma_px),
    )


def shows_anything(keypoints: Keypoints) -> Bools:
    """(B, C) whether a camera's frame has any detection."""
    return np.any(np.isfinite(keypoints.px[..., 0]) & (keypoints.confidence > 0), axis=(2, 3))


def _ticks(time_s: Floats, end_s: Floats, step_s: Floats) -> Ints:
    """(G, C, N) ticks since the step began; `_END` at its end, `_NEVER` outside of it."""
    since_s = time_s - (end_s - step_s)[:, None, None]
    step_s = step_s[:, None, None]
    inside = (since_s > SAME_S) & (since_s <= step_s + SAME_S)
    ticks = np.rint(np.where(inside, since_s, 0.0) / _TICK_S).astype(np.int64)
    ticks = np.where(since_s >= step_s - SAME_S, _END, np.maximum(ticks, 1))
    return np.where(inside, ticks, _NEVER)


def _alike(keys: Ints) -> Iterator[Ints]:
    """Indices of equal rows of `keys` (G, n), group by group."""
    if (keys == keys[0]).all():
        yield np.arange(len(keys))
        return
    _, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.reshape(-1)
    for k in range(int(group.max()) + 1):
        yield np.flatnonzero(group == k)


def _spans(times: Ints) -> list[tuple[int, int]]:
    """First and last tick of each set in sorted ticks."""
    spans: list[tuple[int, int]] = []
    for tick in map(int, times[times < _NEVER]):
        if spans and tick - spans[-1][0] <= _TOGETHER_TICKS:
            spans[-1] = (spans[-1][0], tick)
        else:
            spans.append((tick, tick))
    return spans


def _frame_set(frames: Frames, ids: Ints, among: Bools, at_s: Floats) -> FrameSet:
    """The newest frame of each camera `among` (G, C, N)."""
    n = np.where(among, frames.time_s[ids], -np.inf).argmax(2)
    b, c = ids[:, None], np.arange(n.shape[1])
    keypoints = mapped(frames.keypoints, lambda array: array[b, c, n])
    has = np.asarray(among.any(2))
    return FrameSet(keypoints if has.all() else without(keypoints, ~has), has, at_s)
