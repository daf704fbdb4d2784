"""Wrapper of an estimator that processes late frames at the times at which they were taken.

`OutOfSequence` wraps any estimator. It stores the state of the inner estimator at the end of every
control step, and the frames of every camera with their times. When a late frame arrives, the last
state before that frame is restored, and the later steps are repeated with new random numbers. The
prediction of each step is split at the exact times of its frames.

Frames are ignored, and counted in `LateState.ignored`, if their time lies in the future, is older
than the stored states, is not newer than a used frame of the same camera, or is not finite.
"""

from dataclasses import dataclass
from math import ceil
from typing import Any, Generic, NamedTuple

import numpy as np

from hrc_env.core.batching import map_arrays, rows, select_streams, write_rows
from hrc_env.core.errors import check_shape
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints, Rngs
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.frame_sets import (
    SAME_S,
    Frames,
    FrameSet,
    add_held_frames,
    drop_cameras,
    forget_frames,
    group_frames,
    has_detections,
    make_frames,
    remember,
)
from hrc_env.tracking.interface import Estimator, State

IGNORED = ("no time", "future", "not newer", "too old")
"""Reasons for ignoring frames, in the order of the last axis of `LateState.ignored`."""
_AHEAD_S = 1e-3
"""Maximum time by which a frame may be ahead of the clock to count as current [s]."""


class LateState(NamedTuple, Generic[State]):
    """Current and past states of an estimator, and the frames between them; changed in place.

    The past states form a ring buffer of K slots, one for each control step. The state of the
    current slot is `now`.
    """

    now: State
    """State of the inner estimator at time `clock_s`."""
    clock_s: Floats
    """(B,) time since the reset [s]."""
    slot: Ints
    """(B,) index of the current slot."""
    n_kept: Ints
    """(B,) number of slots before the current one that hold a state."""
    end_s: Floats
    """(B, K) time at which each step ended [s]."""
    step_s: Floats
    """(B, K) length of each step [s]."""
    kept: State
    """States at the ends of the steps: the arrays of `now` with axes (B, K, ...)."""
    frames: Frames
    """Frames that may be processed again."""
    ignored: Ints
    """(B, 4) number of ignored frames for each of the reasons in `IGNORED`."""


@dataclass(frozen=True, slots=True)
class OutOfSequence(Generic[State]):
    """Wrapper that accepts late frames up to `max_delay_s`; see `tracking.estimators.Estimator`.

    The wrapper stores a copy of the inner state for every control step within that time, which
    requires several megabytes for the estimator `paper`.
    """

    inner: Estimator[State]
    """The wrapped estimator."""
    n_cameras: int
    """Number of cameras."""
    ctrl_dt: float
    """Nominal time between two predictions [s]. With more frequent predictions, the stored states
    cover a shorter time."""
    max_delay_s: float
    """Maximum age of frames that are processed [s]; older ones are ignored."""
    needs_pairs: bool = False
    """Whether the inner estimator needs at least two cameras. If so, a frame that arrives alone is
    accompanied by the last frames of the other cameras."""

    @property
    def config(self) -> TrackerConfig:
        """Settings of the inner estimator."""
        return self.inner.config

    def init(self, batch: int, n_workers: int) -> LateState[State]:
        """Return the state before any detection, at time 0."""
        now = self.inner.init(batch, n_workers)
        n_slots = ceil(self.max_delay_s / self.ctrl_dt - 1e-9) + 2
        return LateState(
            now=now,
            clock_s=np.zeros(batch),
            slot=np.zeros(batch, np.int64),
            n_kept=np.zeros(batch, np.int64),
            end_s=np.zeros((batch, n_slots)),
            step_s=np.zeros((batch, n_slots)),
            kept=map_arrays(now, lambda array: np.repeat(array[:, None], n_slots, axis=1)),
            frames=make_frames(batch, self.n_cameras, 2 * n_slots, n_workers),
            ignored=np.zeros((batch, len(IGNORED)), np.int64),
        )

    def reset(self, state: LateState[State], ids: Ints, rngs: Rngs) -> None:
        """Reset environments `ids`; their clocks start at 0."""
        self.inner.reset(state.now, ids, rngs)
        state.clock_s[ids], state.slot[ids], state.n_kept[ids] = 0.0, 0, 0
        state.end_s[ids], state.step_s[ids], state.ignored[ids] = 0.0, 0.0, 0
        forget_frames(state.frames, ids)

    def predict(self, state: LateState[State], dt_s: float, rngs: Rngs) -> None:
        """Store the current state, open a new slot, and predict the state after `dt_s` [s]."""
        every, n_slots = np.arange(len(state.clock_s)), state.end_s.shape[1]
        self._keep(state, every, 0)
        state.n_kept[:] = np.minimum(state.n_kept + 1, n_slots - 1)
        state.slot[:] = (state.slot + 1) % n_slots
        state.clock_s[:] += dt_s
        state.end_s[every, state.slot] = state.clock_s
        state.step_s[every, state.slot] = dt_s
        self.inner.predict(state.now, dt_s, rngs)

    def update(self, state: LateState[State], keypoints: Keypoints, rngs: Rngs) -> None:
        """Update the state with each frame at the time at which the frame was taken."""
        batch, n_workers = len(state.clock_s), state.frames.keypoints.px.shape[3]
        shape = (batch, self.n_cameras, n_workers, N_JOINTS)
        check_shape("Keypoints.px", keypoints.px.shape, (*shape, 2), "B, C, W, J, 2")
        time_s = np.repeat(state.clock_s[:, None], self.n_cameras, 1)
        if keypoints.time_s is not None:
            check_shape("Keypoints.time_s", keypoints.time_s.shape, shape[:2], "B, C")
            time_s = _snap_to_present(keypoints.time_s, time_s)
        ends_s = _list_ends(state)
        use = _select_usable(state, keypoints, time_s, ends_s, self.max_delay_s)
        first_s = np.where(use, time_s, np.inf).min(1)
        late = first_s < state.clock_s - SAME_S
        seen_now = (state.frames.newest_s >= state.clock_s[:, None] - SAME_S).any(1)
        late |= seen_now & use.any(1) & np.isfinite(ends_s[:, 0])  # repeat it as one update
        remember(state.frames, keypoints, time_s, use)
        back = np.where(late, 1 + (ends_s >= first_s[:, None] - SAME_S).sum(1), 0)
        self._use_present(state, keypoints, use & ~late[:, None], rngs)
        for age in range(int(back.max(initial=0)), 0, -1):
            begins = np.flatnonzero(back == age)
            past = rows(_flatten_slots(state.kept), _find_slots(state, begins, age))
            write_rows(state.now, begins, past)
            ids = np.flatnonzero(back >= age)
            self._repeat_step(state, ids, age, rngs)
            if age > 1:
                self._keep(state, ids, age - 1)

    def estimate(self, state: LateState[State]) -> PoseEstimate:
        """Return the current estimate."""
        return self.inner.estimate(state.now)

    def forecast(self, state: LateState[State], horizon_s: float) -> PoseEstimate:
        """Return the estimate expected after `horizon_s` [s]; see `tracking.forecast`."""
        return self.inner.forecast(state.now, horizon_s)

    def _use_present(
        self, state: LateState[State], keypoints: Keypoints, use: Bools, rngs: Rngs
    ) -> None:
        """Update the state with current frames; environments without one are not changed.

        Args:
            state: changed in place.
            keypoints: (B, C, W, J) keypoints.
            use: (B, C) mask of the frames to use.
            rngs: one generator for each environment of the batch.
        """
        if use.all():
            self.inner.update(state.now, keypoints, rngs)
            return
        ids = np.flatnonzero(use.any(1))
        if len(ids) == 0:
            return
        part, used = self._select_states(state, ids), use[ids]
        frame_set = FrameSet(drop_cameras(rows(keypoints, ids), ~used), used, state.clock_s[ids])
        self._use_frames(part, state, ids, frame_set, select_streams(rngs, ids))
        self._write(state, ids, part)

    def _repeat_step(self, state: LateState[State], ids: Ints, age: int, rngs: Rngs) -> None:
        """Repeat a past control step with all of its frames, late ones included.

        `state.now` goes from the beginning to the end of that step: it is predicted to the time of
        each set of frames and updated with it, and is then predicted to the end of the step.

        Args:
            state: `now` of these environments is changed in place.
            ids: (n,) indices of the environments.
            age: 1 for the step that ends at the present time (the open slot), 2 for the step before
                it, and so on.
            rngs: one generator for each environment of the batch, which generate new random
                numbers.
        """
        n_slots = state.end_s.shape[1]
        slots = (state.slot[ids] - age + 1) % n_slots
        end_s, lengths_s = state.end_s[ids, slots], state.step_s[ids, slots]
        for members, length_s, frame_sets in group_frames(state.frames, ids, end_s, lengths_s):
            group_ids = ids[members]  # environments with the same frame times
            group_state = self._select_states(state, group_ids)
            group_rngs = select_streams(rngs, group_ids)
            reached_s = 0.0  # from the beginning of the step
            for since_start_s, frame_set in frame_sets:
                self.inner.predict(group_state, since_start_s - reached_s, group_rngs)
                self._use_frames(group_state, state, group_ids, frame_set, group_rngs)
                reached_s = since_start_s
            if length_s > reached_s:
                self.inner.predict(group_state, length_s - reached_s, group_rngs)
            self._write(state, group_ids, group_state)

    def _use_frames(
        self, part: State, state: LateState[State], ids: Ints, frame_set: FrameSet, rngs: Rngs
    ) -> None:
        """Update states with a set of frames, and with the last frames of other cameras if needed.

        The latter are added for workers without a track, or for all workers if `needs_pairs` is
        true.

        Args:
            part: states of the environments, changed in place.
            state: the whole state.
            ids: indices of the environments.
            frame_set: the frames.
            rngs: one generator for each of these environments.
        """
        keypoints = frame_set.keypoints
        if not frame_set.has.all():
            tracked = self.inner.estimate(part).tracked
            wanted = ~tracked if not self.needs_pairs else np.ones_like(tracked)
            if wanted.any():
                keypoints = add_held_frames(state.frames, ids, frame_set, wanted)
        self.inner.update(part, keypoints, rngs)

    def _select_states(self, state: LateState[State], ids: Ints) -> State:
        """Return the current states of environments `ids`, copied unless these are all of them."""
        return state.now if len(ids) == len(state.clock_s) else rows(state.now, ids)

    def _write(self, state: LateState[State], ids: Ints, part: State) -> None:
        """Write the states of environments `ids` back if they are copies."""
        if part is not state.now:
            write_rows(state.now, ids, part)

    def _keep(self, state: LateState[State], ids: Ints, age: int) -> None:
        """Store the current states of some environments in a slot.

        Args:
            state: changed in place.
            ids: indices of the environments.
            age: number of slots from this slot to the current one.
        """
        slots = _find_slots(state, ids, age)
        write_rows(_flatten_slots(state.kept), slots, self._select_states(state, ids))


def _snap_to_present(time_s: Floats, now_s: Floats) -> Floats:
    """Return times (B, C) [s] in which values almost equal to the current time are set to it."""
    near = (time_s > now_s - SAME_S) & (time_s < now_s + _AHEAD_S)
    return np.where(near, now_s, time_s)


def _list_ends(state: LateState[Any]) -> Floats:
    """Return the times (B, K - 1) at which the steps 1, 2, ... slots ago ended [s].

    The time is -inf for steps with a state that cannot be restored.
    """
    n_slots = state.end_s.shape[1]
    age = np.arange(1, n_slots, dtype=np.int64)
    every = np.arange(len(state.slot))[:, None]
    end_s = state.end_s[every, (state.slot[:, None] - age) % n_slots]
    kept = age <= state.n_kept[:, None]
    known = end_s >= state.frames.forgotten_s[:, None] - SAME_S
    return np.where(kept & known, end_s, -np.inf)


def _select_usable(
    state: LateState[Any],
    keypoints: Keypoints,
    time_s: Floats,
    ends_s: Floats,
    max_delay_s: float,
) -> Bools:
    """Return a mask (B, C) of the usable frames; count the others in `state.ignored`.

    Args:
        state: the counts are changed in place.
        keypoints: (B, C, W, J) keypoints.
        time_s: (B, C) times of the frames [s].
        ends_s: (B, K - 1) ends of the steps, as `_list_ends` returns them [s].
        max_delay_s: largest age of a frame [s].
    """
    now_s = state.clock_s[:, None]
    oldest_s = np.where(np.isfinite(ends_s), ends_s, now_s).min(1)[:, None]
    finite = np.isfinite(time_s)
    reasons = (
        ~finite & has_detections(keypoints),
        finite & (time_s > now_s),
        finite & (time_s <= state.frames.newest_s + SAME_S),
        finite
        & (time_s < now_s)
        & ((time_s < now_s - max_delay_s - SAME_S) | (time_s <= oldest_s + SAME_S)),
    )
    use = finite
    for k, reason in enumerate(reasons):
        state.ignored[:, k] += (reason & (use | ~finite)).sum(1)
        use = use & ~reason
    return use


def _find_slots(state: LateState[Any], ids: Ints, age: int) -> Ints:
    """Return the row of one slot of each environment in the arrays of `_flatten_slots`.

    Args:
        state: the whole state.
        ids: indices of the environments.
        age: number of slots from the slot to the current one.
    """
    n_slots = state.end_s.shape[1]
    return ids * n_slots + (state.slot[ids] - age) % n_slots


def _flatten_slots(kept: State) -> State:
    """Return views (B K, ...) of the arrays (B, K, ...) of a state."""
    return map_arrays(kept, lambda a: a.reshape(a.shape[0] * a.shape[1], *a.shape[2:]))
