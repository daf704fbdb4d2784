"""Inference about the presence of people in workers' slots without a track.

Absence is inferred for patches of floor on which cameras would detect a person (`Coverage`). It
relies on searches of whole images by the cameras. For a worker's slot without a track, each patch
has one of three states:

- `EMPTY`: at least `LEAST_CAMERAS` cameras that see the patch have searched their images often
  enough in succession without finding an untracked person, and at least as many cameras still find
  none.
- `PROBABLY_EMPTY`: at least one camera that sees the patch has found no untracked person in
  `SEVERAL` searches. A single camera cannot prove absence, because about 2 % of workers are
  initially hidden from it.
- `POSSIBLE`: there were too few searches, the cameras that see the patch provide no images or
  frozen ones, no camera sees the patch, or a camera shows an untracked person.

The slot is *absent* if every patch is empty, and *unknown* otherwise. A lost worker may be hidden
at the last estimated position. Therefore no patch becomes empty until the worker is tracked again,
or until that estimate has expired (after `FORGOTTEN` time constants `lost_relaxation_s` without a
measurement) and searches find no person. A search expires after `lost_after_s`, as a track does.
"""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from hrc_env.core.batching import Stateful, change_fields, write_rows
from hrc_env.core.declared import Records1, Records2, Records3, dtype_of, make_records
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints, Points3
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
from hrc_env.tracking.contradiction import DetectedPoses

LEAST_CAMERAS = 2
"""Minimum number of cameras that must search to prove absence."""
IMAGES = 8
"""Number of searches by all cameras together that prove absence if the whole of every image is
searched. For a subset of the cameras, the number is proportionally smaller. In a test, each of
2,000 workers was found in the first images of four cameras."""
SEARCHES = 24
"""Number of searches that prove absence, as for `IMAGES`, if whole images are searched only
occasionally. In tests, the first two searches missed one worker of 180, and six searches found 400
of 400 (tests/properties guarantees 90 %)."""
SEVERAL = 3
"""Number of searches without a person after which a patch of floor is probably empty."""
FORGOTTEN = 3.0
"""Time without a measurement after which the position of a lost worker is forgotten, as a multiple
of `lost_relaxation_s`."""
REPEATED = 2
"""Number of successive images that must show an unexplained person. One image is not enough because
the detector occasionally mistakes the robot for a person."""
CONTRADICTED = 6
"""Number of successive images with an unexplained person, in several cameras, that contradict the
calibration."""
AGREED = 25
"""Number of updates without contradiction after which tracks are trusted again."""


class Slot:
    """Presence of a person in one worker's slot."""

    absent: bool
    """Whether it is known that the slot has no person."""
    lost: bool
    """Whether the slot has a track, or has lost one and its last position is not forgotten yet."""
    unobserved_s: float
    """Time since the cameras last saw the worker, or last found the floor empty [s]."""
    seen_world: Annotated[Points3, (N_JOINTS, 3)]
    """Estimated positions of the joints when a camera last saw the worker [m]; NaN if no camera has
    seen the worker."""


SLOT = dtype_of(Slot)


class SearchCount:
    """Successive searches by one camera that found no person for one slot."""

    empty: int
    """Number of successive searches that found no person for the slot."""
    since_s: float
    """Age of the image in the last of these searches [s]."""


SEARCH_COUNT = dtype_of(SearchCount)


class PresenceArrays(NamedTuple):
    """The arrays of `Presence` that an update changes in place."""

    strangers: Ints
    """(B, C) number of successive images in which a camera showed an unexplained person."""
    doubt: Ints
    """(B,) number of further updates for which all tracks are distrusted."""

    slots: Records2[Slot]
    """(B, W) presence of each worker."""
    searches: Records3[SearchCount]
    """(B, W, C) searches by each camera for each slot."""
    levels: Ints
    """(B, W, G) `POSSIBLE`, `PROBABLY_EMPTY` or `EMPTY` for each group of patches of floor."""
    age_s: Floats
    """(B, W) age of the oldest search on which the levels are based [s]."""
    cameras: Bools
    """(G, C) mask of the cameras that see each group of patches; not changed."""


class Evidence(NamedTuple):
    """The tracks and the searches in one update of `b` environments."""

    tracked: Bools
    """(b, W) mask of the tracked workers; those that are distrusted are removed."""
    age_s: Floats
    """(b, W, J) ages of the workers' joints [s]."""
    mean_world: Points3
    """(b, W, J, 3) estimated positions of the joints [m]."""
    found: Floats
    """(b, C, W, J) confidence of the detections before association with workers."""
    assigned: Floats
    """(b, C, W, J) confidence of the detections after association."""
    shown: DetectedPoses
    """(b, C) masks of the cameras that detect poses, and unexplained poses."""
    others_age_s: Floats
    """(b, N) time since people in excess of the slots were detected [s]; infinite in unused
    rows."""
    searched: Bools
    """(b, C) mask of the cameras that searched their whole image."""
    image_age_s: Floats
    """(b, C) age of the camera's image [s]."""
    enough: int
    """Number of searches that prove absence."""
    dt_s: float
    """Time since the last update [s]."""
    lost_after_s: float
    """Time after which a search expires [s]."""
    forgotten_s: float
    """Time after which the position of a lost worker is forgotten [s]."""


class PresenceReport(NamedTuple):
    """The fields of a `PoseEstimate` that an update of presence fills in."""

    unknown: Bools
    """(b, W) mask of the slots that may have a person without a track."""
    unobserved_s: Floats
    """(b, W) time since cameras last saw the worker or found the floor empty [s]."""
    seen_world: Points3
    """(b, W, J, 3) estimated positions of the joints when a camera last saw the worker [m]."""


class Strangers(NamedTuple):
    """People without a slot in one environment."""

    are_known: bool
    """Whether there are more people than slots."""
    are_possible: bool
    """Whether there may be a person without a slot."""


class FloorState(NamedTuple):
    """The state of a group of patches of floor for one slot."""

    level: int
    """`POSSIBLE`, `PROBABLY_EMPTY` or `EMPTY`."""
    age_s: float
    """Age of the search on which `level` is based [s]; 0 for `POSSIBLE`."""


@dataclass(frozen=True, slots=True)
class ImageSearches:
    """The searches of whole images in one update of B environments."""

    whole: Bools
    """(B, C) mask of the cameras that searched their whole image."""
    age_s: Floats
    """(B, C) age of the camera's image [s]."""
    enough: int
    """Number of searches that prove absence: `IMAGES` or `SEARCHES`."""
    shown: DetectedPoses
    """Masks of the cameras that detect poses, and of those that detect unexplained poses."""
    others: Others
    """Detected people without a slot."""


class Presence(Stateful):
    """The presence of people in the slots of a batch of environments.

    Args:
        batch: number of environments B.
        n_workers: number of slots W in each environment.
        coverage: the patches of floor, and the cameras that see each of them.
    """

    CHANGES = ("slots", "searches", "levels", "age_s", "strangers", "doubt", "others")

    def __init__(self, batch: int, n_workers: int, coverage: Coverage) -> None:
        self.coverage, cameras = coverage, coverage.cameras
        self.slots = make_records(Slot, (batch, n_workers))
        """(B, W) presence of each worker."""
        self.searches = make_records(SearchCount, (batch, n_workers, cameras.shape[1]))
        """(B, W, C) searches by each camera for each slot."""
        self.levels = np.zeros((batch, n_workers, len(cameras)), np.int64)
        """(B, W, G) state of each group of patches of floor for each slot."""
        self.age_s = np.zeros((batch, n_workers))
        """(B, W) age of the oldest search on which `levels` is based [s]."""
        self.strangers = np.zeros((batch, cameras.shape[1]), np.int64)
        """(B, C) number of successive images in which a camera showed an unexplained person."""
        self.doubt = np.zeros(batch, np.int64)
        """(B,) number of further updates for which all tracks are distrusted."""
        self.others = no_others(batch)
        """Detected people without a slot."""
        self.forget(np.arange(batch))

    def forget(self, ids: Ints) -> None:
        """Reset environments `ids` to their state before any search."""
        self.slots[ids], self.searches[ids] = (False, False, 0.0, np.nan), (0, np.inf)
        self.levels[ids], self.age_s[ids], self.strangers[ids] = POSSIBLE, 0.0, 0
        self.doubt[ids] = 0
        write_rows(self.others, ids, no_others(len(ids)))

    def vacancy(self, ids: Ints) -> Vacancy:
        """Return the state of the floor of environments `ids`."""
        others = Others(self.others.hips_world[ids], self.others.age_s[ids])
        return Vacancy(self.coverage, self.levels[ids], self.age_s[ids], others)

    def find_contradicting_cameras(self, ids: Ints) -> Bools:
        """Return a mask (b, C) of cameras in environments `ids` that contradict the calibration.

        Cameras do so if at least `LEAST_CAMERAS` of them have shown an unexplained person in
        `CONTRADICTED` successive images.
        """
        often = self.strangers[ids] >= CONTRADICTED
        return often & (often.sum(1, keepdims=True) >= LEAST_CAMERAS)

    def update(
        self,
        ids: Ints,
        estimate: PoseEstimate,
        found: Keypoints,
        assigned: Keypoints,
        searches: ImageSearches,
        dt_s: float,
        config: TrackerConfig,
    ) -> PoseEstimate:
        """Update the presence of people in environments `ids`.

        Args:
            ids: (b,) indices of the environments, to which the rows of the other arguments belong.
            estimate: (b, W, ...) estimate of the tracker.
            found: (b, C, W, ...) detections before association with workers.
            assigned: (b, C, W, ...) detections after association with workers.
            searches: the searches of whole images.
            dt_s: time since the last update [s].
            config: settings that contain `lost_after_s` and `lost_relaxation_s`.

        Returns:
            The estimate with `unknown`, `unobserved_s` and `seen_world`. While the cameras
            contradict the calibration, no worker is `tracked`.
        """
        write_rows(self.others, ids, searches.others)
        evidence = Evidence(
            tracked=estimate.tracked.copy(),
            age_s=np.ascontiguousarray(estimate.age_s),
            mean_world=np.ascontiguousarray(estimate.mean_world),
            found=found.confidence,
            assigned=assigned.confidence,
            shown=searches.shown,
            others_age_s=searches.others.age_s,
            searched=searches.whole,
            image_age_s=searches.age_s,
            enough=searches.enough,
            dt_s=dt_s,
            lost_after_s=config.lost_after_s - 1e-9,
            forgotten_s=FORGOTTEN * config.lost_relaxation_s,
        )
        shape = estimate.tracked.shape
        report = PresenceReport(
            np.empty(shape, np.bool_), np.empty(shape), np.empty_like(estimate.mean_world)
        )
        arrays = PresenceArrays(
            self.strangers, self.doubt, self.slots, self.searches, self.levels, self.age_s,
            self.coverage.cameras,
        )  # fmt: skip
        _update_slots(arrays, ids, evidence, report)
        return change_fields(
            estimate,
            tracked=evidence.tracked,
            unknown=report.unknown,
            unobserved_s=report.unobserved_s,
            seen_world=report.seen_world,
        )


@kernel
def _update_slots(
    state: PresenceArrays, ids: Ints, evidence: Evidence, report: PresenceReport
) -> None:
    """Update the slots of environments `ids` from the rows of `evidence`, and fill in `report`."""
    tracked = evidence.tracked
    for row in range(len(ids)):
        strange = state.strangers[ids[row]]
        strangers = _find_strangers(state, ids[row], row, evidence)
        for w in range(tracked.shape[1]):
            slot, search = state.slots[ids[row], w], state.searches[ids[row], w]
            level = state.levels[ids[row], w]
            shown = _count_searches(search, strange, strangers.are_possible, row, w, evidence)
            if tracked[row, w]:
                age_s = math.inf
                for joint_age_s in evidence.age_s[row, w]:
                    age_s = min(age_s, joint_age_s)
                if not slot.lost or age_s < slot.unobserved_s + 0.5 * evidence.dt_s:
                    _copy_points(evidence.mean_world[row, w], slot.seen_world)
                slot.lost, slot.absent, slot.unobserved_s = True, False, age_s
                level[:] = POSSIBLE
            else:
                if strangers.are_possible:  # the last position may be another person's
                    _forget_place(slot)
                state.age_s[ids[row], w] = _judge_floor(
                    slot, search, level, state.cameras, shown, evidence
                )
            if tracked[row, w] or shown:
                for c in range(len(search)):
                    search[c].empty = 0
            report.unknown[row, w] = strangers.are_known or not (tracked[row, w] or slot.absent)
            report.unobserved_s[row, w] = slot.unobserved_s
            _copy_points(slot.seen_world, report.seen_world[row, w])


@kernel
def _find_strangers(state: PresenceArrays, b: int, row: int, evidence: Evidence) -> Strangers:
    """Count images with unexplained people, and return whether there are people without a slot.

    Tracks are distrusted for some time after the calibration was contradicted.

    Args:
        state: the presence, of which `strangers` and `doubt` are changed.
        b: index of the environment.
        row: row of the environment in `evidence`, of which `tracked` is changed.
        evidence: the tracks and the searches of the update.
    """
    shown, strange, several, often = evidence.shown, state.strangers[b], 0, 0
    for c in range(len(strange)):
        if evidence.searched[row, c] or shown.poses[row, c]:
            strange[c] = strange[c] + 1 if shown.unexplained[row, c] else 0
        several += strange[c] >= REPEATED
        often += strange[c] >= CONTRADICTED
    state.doubt[b] = AGREED if often >= LEAST_CAMERAS else max(state.doubt[b] - 1, 0)
    doubtful = state.doubt[b] > 0
    if doubtful:
        evidence.tracked[row] = False
    are_known = False
    for age_s in evidence.others_age_s[row]:
        are_known |= age_s < np.inf
    return Strangers(are_known, are_known or doubtful or several >= LEAST_CAMERAS)


@kernel
def _count_searches(
    search: Records1[SearchCount],
    strange: Ints,
    has_strangers: bool,
    row: int,
    w: int,
    evidence: Evidence,
) -> bool:
    """Count the searches for one slot, and return whether a camera shows a person for the slot.

    A camera does so if it detects the slot's worker, or more people than there are tracks.

    Args:
        search: (C,) searches for the slot, changed in place.
        strange: (C,) number of successive images of each camera with an unexplained person.
        has_strangers: whether there may be a person without a slot.
        row: row of the environment in `evidence`.
        w: index of the slot.
        evidence: the tracks and the searches of the update.
    """
    shown, people = has_strangers, evidence.tracked[row].sum()
    for c in range(len(search)):
        search[c].since_s += evidence.dt_s
        n_found, found = 0, evidence.found[row, c]
        for k in range(len(found)):
            n_found += _is_shown(found[k])
        if _is_shown(evidence.assigned[row, c, w]) or n_found > people:
            shown = True
        elif evidence.searched[row, c] and strange[c] < REPEATED:
            search[c].empty += 1
            search[c].since_s = evidence.image_age_s[row, c]
        if search[c].since_s >= evidence.lost_after_s:
            search[c].empty = 0
    return shown


@kernel
def _judge_floor(
    slot: Slot,
    search: Records1[SearchCount],
    level: Ints,
    cameras: Bools,
    shown: bool,
    evidence: Evidence,
) -> float:
    """Update a slot without a track, in place.

    Args:
        slot: the slot.
        search: (C,) searches for the slot.
        level: (G,) state of each group of patches of floor, changed in place.
        cameras: (G, C) mask of the cameras that see each group.
        shown: whether a camera shows a person for the slot.
        evidence: the tracks and the searches of the update.

    Returns:
        The age of the oldest search that found any floor empty [s]; 0 if no search did.
    """
    slot.unobserved_s += evidence.dt_s
    hides = slot.lost and slot.unobserved_s < evidence.forgotten_s
    slot.absent, emptied, oldest = True, False, 0.0
    for g in range(len(cameras)):
        level[g], age_s = _judge_group(search, cameras[g], level[g], evidence.enough, shown, hides)
        slot.absent &= level[g] == EMPTY
        if level[g] != POSSIBLE:
            emptied, oldest = True, max(oldest, age_s)
    if slot.absent:
        slot.unobserved_s = oldest
    if slot.absent or (emptied and not hides):
        _forget_place(slot)
    return oldest


@kernel
def _judge_group(
    search: Records1[SearchCount], sees: Bools, level: int, enough: int, shown: bool, hides: bool
) -> FloorState:
    """Return the state of one group of patches of floor for a slot without a track.

    Args:
        search: (C,) searches for the slot.
        sees: (C,) mask of the cameras that see the group.
        level: current state of the group.
        enough: number of searches by all cameras that prove absence.
        shown: whether a camera shows a person for the slot.
        hides: whether a lost worker may still be hidden.
    """
    total, cameras, least, second = 0, 0, np.inf, np.inf
    needed = enough * sees.sum() / len(sees)
    for c in range(len(search)):
        if sees[c] and search[c].empty > 0:
            total, cameras = total + search[c].empty, cameras + 1
            second = min(second, max(least, search[c].since_s))
            least = min(least, search[c].since_s)
    if shown or cameras == 0:
        return FloorState(POSSIBLE, 0.0)
    if cameras >= LEAST_CAMERAS and (level == EMPTY or (total >= needed and not hides)):
        return FloorState(EMPTY, second)
    if level != POSSIBLE or (total >= SEVERAL and not hides):
        return FloorState(PROBABLY_EMPTY, least)
    return FloorState(POSSIBLE, 0.0)


@kernel
def _copy_points(points: Points3, out: Points3) -> None:
    """Copy joints `points` (J, 3) to `out` (J, 3)."""
    for j in range(N_JOINTS):
        for i in range(3):
            out[j, i] = points[j, i]


@kernel
def _forget_place(slot: Slot) -> None:
    """Discard the lost track of a slot and its last position, in place."""
    slot.lost = False
    for j in range(N_JOINTS):
        for i in range(3):
            slot.seen_world[j, i] = np.nan


@kernel
def _is_shown(confidence: Floats) -> bool:
    """Return whether any of the confidences (J,) is positive."""
    most = 0.0
    for value in confidence:
        most = max(most, value)
    return most > 0.0
