"""Frames that arrive late are used at their own time: a short memory, and replay.

`OutOfSequence` wraps any estimator. It keeps what the inner one believed at the end of every
control step, and the frames of every camera with their times. Before a frame that was taken before
now the belief of then is restored, and what came after is lived through again (with new random
numbers), each step's prediction split at the exact times of its frames.

Frames from the future, too old for the memory, not newer than a frame of the same camera that was
used already, or without a finite time are left out and counted (`LateState.ignored`).
"""

from dataclasses import dataclass
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from hrc_env.core.batching import mapped, picked, rows, write_rows
from hrc_env.core.errors import check_shape
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints, Rngs
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.frame_sets import (
    SAME_S,
    Frames,
    FrameSet,
    beside,
    forget_frames,
    frame_sets_of,
    make_frames,
    remember,
    shows_anything,
    without,
)

IGNORED = ("no time", "future", "not newer", "too old")
"""Why frames were left out; the last axis of `LateState.ignored`."""
_AHEAD_S = 1e-3
"""Clocks that are no more ahead than this mean now."""


class LateState(NamedTuple):
    """What is believed, what was believed, and the frames between; arrays changed in place.

    K slots form a ring; a control step ends in a slot. The open slot's belief is `now`.
    """

    now: Any
    """The inner estimator's state at the clock."""
    clock_s: Floats
    """(B,) time since the reset [s]."""
    slot: Ints
    """(B,) the open slot."""
    n_kept: Ints
    """(B,) how many slots before it hold a belief."""
    end_s: Floats
    """(B, K) when each step ended."""
    step_s: Floats
    """(B, K) how long each step was."""
    kept: Any
    """As `now`, with arrays (B, K, ...): beliefs at the ends of the steps."""
    frames: Frames
    """Frames that may be needed again."""
    ignored: Ints
    """(B, 4) frames left out, by `IGNORED`."""


@dataclass(frozen=True, slots=True)
class OutOfSequence:
    """An estimator with a memory of `longest_delay_s`; see `tracking.estimators.Estimator`.

    It holds a copy of the inner state for every control step of that time: of `paper`'s, megabytes.
    """

    inner: Any
    """The estimator (`tracking.estimators.Estimator`) that is asked."""
    n_cameras: int
    ctrl_dt: float
    """The usual time between two predictions [s]; shorter ones shorten the memory."""
    longest_delay_s: float
    """Frames older than this are too old [s]."""
    needs_pairs: bool = False
    """Whether the inner estimator makes nothing of a camera alone: then it is shown the others'
    last frames beside one that came out of step."""

    @property
    def config(self) -> TrackerConfig:
        """The settings of the inner estimator."""
        return self.inner.config

    def init(self, batch: int, n_workers: int) -> LateState:
        """Workers whom nobody has seen, at time 0."""
        now = self.inner.init(batch, n_workers)
        n_slots = ceil(self.longest_delay_s / self.ctrl_dt - 1e-9) + 2
        return LateState(
            now=now,
            clock_s=np.zeros(batch),
            slot=np.zeros(batch, np.int64),
            n_kept=np.zeros(batch, np.int64),
            end_s=np.zeros((batch, n_slots)),
            step_s=np.zeros((batch, n_slots)),
            kept=mapped(now, lambda array: np.repeat(array[:, None], n_slots, axis=1)),
            frames=make_frames(batch, self.n_cameras, 2 * n_slots, n_workers),
            ignored=np.zeros((batch, len(IGNORED)), np.int64),
        )

    def reset(self, state: LateState, ids: Ints, rngs: Rngs) -> None:
        """Forget environments `ids`; their clocks start at 0."""
        self.inner.reset(state.now, ids, rngs)
        state.clock_s[ids], state.slot[ids], state.n_kept[ids] = 0.0, 0, 0
        state.end_s[ids], state.step_s[ids], state.ignored[ids] = 0.0, 0.0, 0
        forget_frames(state.frames, ids)

    def predict(self, state: LateState, dt_s: float, rngs: Rngs) -> None:
        """Keep what is believed, close the slot, and let `dt_s` seconds pass."""
        every, n_slots = np.arange(len(state.clock_s)), state.end_s.shape[1]
        self._keep(state, every, 0)
        state.n_kept[:] = np.minimum(state.n_kept + 1, n_slots - 1)
        state.slot[:] = (state.slot + 1) % n_slots
        state.clock_s[:] += dt_s
        state.end_s[every, state.slot] = state.clock_s
        state.step_s[every, state.slot] = dt_s
        self.inner.predict(state.now, dt_s, rngs)

    def update(self, state: LateState, keypoints: Keypoints, rngs: Rngs) -> None:
        """Take frames in, each at its time (`Keypoints.time_s`); draws what the inner one does."""
        batch, n_workers = len(state.clock_s), state.frames.keypoints.px.shape[3]
        shape = (batch, self.n_cameras, n_workers, N_JOINTS)
        check_shape("Keypoints.px", keypoints.px.shape, (*shape, 2), "B, C, W, J, 2")
        time_s = np.repeat(state.clock_s[:, None], self.n_cameras, 1)
        if keypoints.time_s is not None:
            check_shape("Keypoints.time_s", keypoints.time_s.shape, shape[:2], "B, C")
            time_s = _near_now(keypoints.time_s, time_s)
        ends_s = _ends_by_age(state)
        use = _usable(state, keypoints, time_s, ends_s, self.longest_delay_s)
        first_s = np.where(use, time_s, np.inf).min(1)
        late = first_s < state.clock_s - SAME_S
        seen_now = (state.frames.newest_s >= state.clock_s[:, None] - SAME_S).any(1)
        late |= seen_now & use.any(1) & np.isfinite(ends_s[:, 0])  # one update, not two
        remember(state.frames, keypoints, time_s, use)
        back = np.where(late, 1 + (ends_s >= first_s[:, None] - SAME_S).sum(1), 0)
        self._take_in(state, keypoints, use & ~late[:, None], rngs)
        for age in range(int(back.max(initial=0)), 0, -1):
            begins = np.flatnonzero(back == age)
            write_rows(state.now, begins, rows(_flat(state.kept), _places(state, begins, age)))
            ids = np.flatnonzero(back >= age)
            self._relive(state, ids, age, rngs)
            if age > 1:
                self._keep(state, ids, age - 1)

    def estimate(self, state: LateState) -> PoseEstimate:
        """What is believed now."""
        return self.inner.estimate(state.now)

    def forecast(self, state: LateState, horizon_s: float) -> PoseEstimate:
        """What is expected in `horizon_s`; see `tracking.forecast`."""
        return self.inner.forecast(state.now, horizon_s)

    def _take_in(self, state: LateState, keypoints: Keypoints, use: Bools, rngs: Rngs) -> None:
        """Update with frames of now, `use` (B, C); environments without one are left alone."""
        if use.all():
            self.inner.update(state.now, keypoints, rngs)
            return
        ids = np.flatnonzero(use.any(1))
        if len(ids) == 0:
            return
        part = self._part(state, ids)
        frame_set = FrameSet(without(rows(keypoints, ids), ~use[ids]), use[ids], state.clock_s[ids])
        self._see(part, state, ids, frame_set, picked(rngs, ids))
        self._write(state, ids, part)

    def _relive(self, state: LateState, ids: Ints, age: int, rngs: Rngs) -> None:
        """Let environments `ids` live again through the step that ended `age` - 1 slots back."""
        slot = (state.slot[ids] - age + 1) % state.end_s.shape[1]
        steps = (state.end_s[ids, slot], state.step_s[ids, slot])
        for members, step_s, frame_sets in frame_sets_of(state.frames, ids, *steps):
            group, done_s = ids[members], 0.0
            part, streams = self._part(state, group), picked(rngs, group)
            for at_s, frame_set in frame_sets:
                self.inner.predict(part, at_s - done_s, streams)
                self._see(part, state, group, frame_set, streams)
                done_s = at_s
            if step_s > done_s:
                self.inner.predict(part, step_s - done_s, streams)
            self._write(state, group, part)

    def _see(self, part: Any, state: LateState, ids: Ints, frame_set: FrameSet, rngs: Rngs) -> None:
        """Update with the frames of a set; whom nobody follows is shown held ones beside."""
        keypoints = frame_set.keypoints
        if not frame_set.has.all():
            tracked = self.inner.estimate(part).tracked
            wanted = ~tracked if not self.needs_pairs else np.ones_like(tracked)
            if wanted.any():
                keypoints = beside(state.frames, ids, frame_set, wanted)
        self.inner.update(part, keypoints, rngs)

    def _part(self, state: LateState, ids: Ints) -> Any:
        return state.now if len(ids) == len(state.clock_s) else rows(state.now, ids)

    def _write(self, state: LateState, ids: Ints, part: Any) -> None:
        if part is not state.now:
            write_rows(state.now, ids, part)

    def _keep(self, state: LateState, ids: Ints, age: int) -> None:
        """Put what is believed into the slot `age` before the open one."""
        write_rows(_flat(state.kept), _places(state, ids, age), self._part(state, ids))


def _near_now(time_s: Floats, now_s: Floats) -> Floats:
    """Times with those that mean now put there."""
    near = (time_s > now_s - SAME_S) & (time_s < now_s + _AHEAD_S)
    return np.where(near, now_s, time_s)


def _ends_by_age(state: LateState) -> Floats:
    """(B, K - 1) ends of the steps 1, 2, ... slots back; -inf where one cannot return to."""
    n_slots = state.end_s.shape[1]
    age = np.arange(1, n_slots)
    every = np.arange(len(state.slot))[:, None]
    end_s = state.end_s[every, (state.slot[:, None] - age) % n_slots]
    kept = age <= state.n_kept[:, None]
    known = end_s >= state.frames.forgotten_s[:, None] - SAME_S
    return np.where(kept & known, end_s, -np.inf)


def _usable(
    state: LateState,
    keypoints: Keypoints,
    time_s: Floats,
    ends_s: Floats,
    longest_delay_s: float,
) -> Bools:
    """(B, C) which frames can be used; the others are counted, each for one reason."""
    now_s = state.clock_s[:, None]
    oldest_s = np.where(np.isfinite(ends_s), ends_s, now_s).min(1)[:, None]
    finite = np.isfinite(time_s)
    reasons = (
        ~finite & shows_anything(keypoints),
        finite & (time_s > now_s),
        finite & (time_s <= state.frames.newest_s + SAME_S),
        finite
        & (time_s < now_s)
        & ((time_s < now_s - longest_delay_s - SAME_S) | (time_s <= oldest_s + SAME_S)),
    )
    use = finite
    for k, reason in enumerate(reasons):
        state.ignored[:, k] += (reason & (use | ~finite)).sum(1)
        use = use & ~reason
    return use


def _places(state: LateState, ids: Ints, age: int) -> Ints:
    """Rows of `_flat(kept)` that hold what environments believed `age` slots back."""
    n_slots = state.end_s.shape[1]
    return ids * n_slots + (state.slot[ids] - age) % n_slots


def _flat(record: Any) -> Any:
    """Views (B K, ...) of arrays (B, K, ...)."""
    return mapped(record, lambda a: a.reshape(a.shape[0] * a.shape[1], *a.shape[2:]))
