"""Presence of people without a track: unknown is not absent.

Absence is a statement about pieces of floor on which cameras would detect a person (`Coverage`).
For a worker's slot without a track each piece is

- `EMPTY`: at least `LEAST_CAMERAS` cameras that see it have searched their whole images enough
  times in a row without an untracked person, and at least that many still do;
- `PROBABLY_EMPTY`: at least one camera that sees it has, in `SEVERAL` looks. One camera alone
  proves no more: some 2 % of workers begin hidden from it;
- `POSSIBLE`: the looks are too few, the cameras that see it give no images or stuck ones, no camera
  sees it, or a camera shows an untracked person.

The slot is *absent* if every piece is empty, else *unknown*. A lost worker may hide at the last
estimated place: no piece becomes empty until the track is back, or until that estimate is forgotten
(`FORGOTTEN` time constants `forget_s` without a measurement) and looks find no person. Looks are
forgotten as a track is, `lost_after_s` later.
"""

from dataclasses import dataclass, replace

import numpy as np

from hrc_env.core.batching import Stateful, rows, write_rows
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.core.vacancy import (
    EMPTY,
    POSSIBLE,
    PROBABLY_EMPTY,
    Coverage,
    Others,
    Vacancy,
    no_others,
)
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.contradiction import Shown

LEAST_CAMERAS = 2
IMAGES, SEARCHES = 8, 24
"""Looks of all cameras together that prove absence, with full detection and by searches; a part of
the rig needs its share. Each of 2,000 workers was in the first images of four cameras, the first
two searches missed one of 180, and six found 400 of 400 (tests/properties holds 90 %)."""
SEVERAL = 3
"""Looks of one camera after which floor is probably empty."""
FORGOTTEN = 3.0
SLOT = np.dtype(
    [
        # whether it is known that nobody is there; whether a track was lost; time since cameras
        # last said something about it [s]
        ("absent", "?"), ("lost", "?"), ("blind_s", "f8"),
        # where the worker was believed to be when a camera showed them last [m]
        ("seen_world", "f8", (N_JOINTS, 3)),
    ],
    align=True,
)  # fmt: skip
"""What is known of one worker's slot."""
LOOK = np.dtype([("empty", "i8"), ("since_s", "f8")], align=True)
"""How often in a row a camera showed nobody for a slot; age of its image in which it last did."""
REPEATED = 2
"""Looks in a row at an unexplained person before it counts: the detector takes the robot for a
person now and then."""
CONTRADICTED = 6
"""Looks in a row of several cameras at an unexplained person that contradict the calibration."""
AGREED = 25
"""Updates without contradiction after which tracks are believed again."""


@dataclass(frozen=True, slots=True)
class Looks:
    """The searches of whole images in one update."""

    whole: Bools
    """(B, C) whether a camera searched its whole image."""
    age_s: Floats
    """(B, C) age of the camera's image [s]."""
    enough: int
    """The number of looks that prove absence: `IMAGES` or `SEARCHES`."""
    shown: Shown
    """The poses in these images, explained and not."""
    others: Others
    """The people beyond the slots."""


class Presence(Stateful):
    """The presence of people in the slots of a batch of environments."""

    CHANGES = ("slots", "looks", "levels", "age_s", "strangers", "doubt", "others")

    def __init__(self, batch: int, n_workers: int, coverage: Coverage) -> None:
        """`coverage`: the cameras that see each piece of floor."""
        self.coverage, cameras = coverage, coverage.cameras
        self.slots = np.zeros((batch, n_workers), SLOT)
        self.looks = np.zeros((batch, n_workers, cameras.shape[1]), LOOK)
        self.levels = np.zeros((batch, n_workers, len(cameras)), np.int64)
        self.age_s = np.zeros((batch, n_workers))
        self.strangers = np.zeros((batch, cameras.shape[1]), np.int64)
        """(B, C) looks in a row in which a camera showed an unexplained person."""
        self.doubt = np.zeros(batch, np.int64)
        """(B,) updates for which no track will be believed."""
        self.others = no_others(batch)
        self.forget(np.arange(batch))

    def forget(self, ids: Ints) -> None:
        """Start environments `ids` again, before any look."""
        self.slots[ids], self.looks[ids] = (False, False, 0.0, np.nan), (0, np.inf)
        self.levels[ids], self.age_s[ids], self.strangers[ids] = POSSIBLE, 0.0, 0
        self.doubt[ids] = 0
        write_rows(self.others, ids, no_others(len(ids)))

    def vacancy(self, ids: Ints) -> Vacancy:
        """Return the state of the floor."""
        others = rows(self.others, ids)
        return Vacancy(self.coverage, self.levels[ids], self.age_s[ids], others)

    def contradicted(self, ids: Ints) -> Bools:
        """Return (B, C) the cameras of environments `ids` that contradict the calibration: several
        of them have shown an unexplained person in `CONTRADICTED` looks in a row."""
        often = self.strangers[ids] >= CONTRADICTED
        return often & (often.sum(1, keepdims=True) >= LEAST_CAMERAS)

    def update(
        self,
        ids: Ints,
        estimate: PoseEstimate,
        found: Keypoints,
        sorted_: Keypoints,
        looks: Looks,
        dt_s: float,
        config: TrackerConfig,
    ) -> PoseEstimate:
        """Advance environments `ids` by one update.

        Args:
            ids: (B,) environments, the rows of the other arguments.
            estimate: (B, W, ...) of the tracker.
            found, sorted_: (B, C, W, ...) detections before and after association with workers.
            looks: the searches of whole images.
            dt_s: time since the last update [s].
            config: times after which tracks are lost and forgotten.

        Returns:
            The estimate with `unknown`, `blind_s` and `seen_world`; contradicted tracks are not
            `tracked`.
        """
        strange = np.where(looks.shown.unexplained, self.strangers[ids] + 1, 0)
        strange = np.where(looks.whole | looks.shown.poses, strange, self.strangers[ids])
        self.strangers[ids], whole = strange, looks.whole & (strange < REPEATED)
        contradicted = self.contradicted(ids).any(1)
        self.doubt[ids] = np.where(contradicted, AGREED, np.maximum(self.doubt[ids] - 1, 0))
        doubtful = self.doubt[ids] > 0
        estimate = replace(estimate, tracked=estimate.tracked & ~doubtful[:, None])
        write_rows(self.others, ids, looks.others)
        someone = looks.others.any | doubtful | ((strange >= REPEATED).sum(1) >= LEAST_CAMERAS)
        shape = estimate.tracked.shape
        unknown, blind_s = np.empty(shape, bool), np.empty(shape)
        seen_world = np.empty_like(estimate.mean_world)
        _update(
            (self.slots, self.looks, self.levels, self.age_s, self.coverage.cameras), ids,
            (estimate.tracked, estimate.age_s.min(-1), estimate.mean_world),
            (found.confidence, sorted_.confidence, someone),
            (whole, looks.age_s, looks.enough),
            (dt_s, config.lost_after_s - 1e-9, FORGOTTEN * config.forget_s),
            (unknown, blind_s, seen_world),
        )  # fmt: skip
        unknown |= looks.others.any[:, None]
        return replace(estimate, unknown=unknown, blind_s=blind_s, seen_world=seen_world)


@kernel
def _update(known, ids, belief, seen, looked, times, out):
    slots, looks, levels, ages, cameras = known
    (tracked, age_s, mean), (unknown, blind, seen_world) = belief, out
    for row in range(len(ids)):
        for w in range(tracked.shape[1]):
            slot, look, level = slots[ids[row], w], looks[ids[row], w], levels[ids[row], w]
            people = tracked[row].sum()
            shown = _look(look, row, w, people, seen, looked, times)
            if tracked[row, w]:
                if not slot.lost or age_s[row, w] < slot.blind_s + 0.5 * times[0]:
                    _copy(mean[row, w], slot.seen_world)
                slot.lost, slot.absent, slot.blind_s = True, False, age_s[row, w]
                level[:] = POSSIBLE
            else:
                if seen[2][row]:  # the last estimated place need not be theirs
                    _forget_place(slot)
                ages[ids[row], w] = _search(slot, look, level, cameras, shown, looked[2], times)
            if tracked[row, w] or shown:
                for c in range(len(look)):
                    look[c].empty = 0
            unknown[row, w] = not (tracked[row, w] or slot.absent)
            blind[row, w] = slot.blind_s
            _copy(slot.seen_world, seen_world[row, w])


@kernel
def _copy(points, to):
    for j in range(N_JOINTS):
        for i in range(3):
            to[j, i] = points[j, i]


@kernel
def _look(look, row, w, people, seen, looked, times):
    """Count looks (C,) for a slot; whether one shows its worker or an untracked person."""
    (dt, lost_after, _), (whole, image_age, _), (found, own, strangers) = times, looked, seen
    shown = strangers[row]
    for c in range(len(look)):
        look[c].since_s += dt
        if _is_shown(own[row, c, w]) or _poses(found[row, c]) > people:
            shown = True
        elif whole[row, c]:
            look[c].empty += 1
            look[c].since_s = image_age[row, c]
        if look[c].since_s >= lost_after:
            look[c].empty = 0
    return shown


@kernel
def _search(slot, look, level, cameras, shown, enough, times):
    """Update a slot without a track; return the age of the looks that emptied the floor [s]."""
    dt, _, forgotten = times
    slot.blind_s += dt
    hides = slot.lost and slot.blind_s < forgotten
    slot.absent, emptied, oldest = True, False, 0.0
    for g in range(len(cameras)):
        level[g], age_s = _vacant(look, cameras[g], level[g], enough, shown, hides)
        slot.absent &= level[g] == EMPTY
        if level[g] != POSSIBLE:
            emptied, oldest = True, max(oldest, age_s)
    if slot.absent:
        slot.blind_s = oldest
    if slot.absent or (emptied and not hides):
        _forget_place(slot)
    return oldest


@kernel
def _forget_place(slot):
    slot.lost = False
    for j in range(N_JOINTS):
        for i in range(3):
            slot.seen_world[j, i] = np.nan


@kernel
def _vacant(look, sees, level, enough, shown, hides):
    """Return the state of floor that cameras (C,) `sees` cover, and the age of its look."""
    total, cameras, least, second = 0, 0, np.inf, np.inf
    needed = enough * sees.sum() / len(sees)
    for c in range(len(look)):
        if sees[c] and look[c].empty > 0:
            total, cameras = total + look[c].empty, cameras + 1
            second = min(second, max(least, look[c].since_s))
            least = min(least, look[c].since_s)
    if shown or cameras == 0:
        return POSSIBLE, 0.0
    if cameras >= LEAST_CAMERAS and (level == EMPTY or (total >= needed and not hides)):
        return EMPTY, second
    if level != POSSIBLE or (total >= SEVERAL and not hides):
        return PROBABLY_EMPTY, least
    return POSSIBLE, 0.0


@kernel
def _poses(confidence):
    """How many workers (W, J) a camera shows."""
    n = 0
    for w in range(len(confidence)):
        n += _is_shown(confidence[w])
    return n


@kernel
def _is_shown(confidence):
    """Whether any joint (J,) is seen."""
    most = 0.0
    for value in confidence:
        most = max(most, value)
    return most > 0.0
