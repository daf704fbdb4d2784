"""Whether somebody may be where nobody is tracked: unknown is not absent.

Of a worker's slot that has no track one of two things is known. It is *absent*: at least
`LEAST_CAMERAS` cameras have looked over their whole images, `IMAGES` or `SEARCHES` times in a row
all together, and shown nobody who was not tracked, and at least that many still do. Else it is
*unknown*: nobody has looked enough yet, cameras give no images or stuck ones, one shows somebody
who is not tracked yet, or a track was lost. Somebody lost may hide where they were believed last:
they stay unknown until they are tracked again, or until that belief is forgotten (`FORGOTTEN` time
constants `forget_s` without a measurement) and looks find nobody. Absence is forgotten as a track
is, `lost_after_s` after cameras last looked. One camera alone never says that nobody is there: some
2 % of workers begin hidden from it.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.tracking.config import TrackerConfig

LEAST_CAMERAS = 2
IMAGES, SEARCHES = 8, 24
"""So many looks say that nobody is there, of images each of which shows whoever can be seen, and of
searches. Of 2,000 workers some of four cameras' first images showed each, of 180 one was not found
by their first two searches; within six 400 of 400 were tracked (tests/properties holds 90 %)."""
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


def make_presence(batch: int, n_workers: int, n_cameras: int) -> tuple[Any, Any]:
    """(B, W) records of `SLOT`, (B, W, C) of `LOOK`: nobody has looked yet."""
    shape = batch, n_workers
    known = np.zeros(shape, SLOT), np.zeros((*shape, n_cameras), LOOK)
    forget_presence(known, np.arange(batch))
    return known


def forget_presence(known: tuple[Any, Any], ids: Ints) -> None:
    """Begin environments `ids` anew."""
    slots, looks = known
    slots[ids], looks[ids] = (False, False, 0.0, np.nan), (0, np.inf)


def with_presence(
    known: tuple[Any, Any],
    ids: Ints,
    estimate: PoseEstimate,
    views: tuple[Keypoints, Keypoints],
    looked: tuple[Bools, Floats, int],
    dt_s: float,
    config: TrackerConfig,
) -> PoseEstimate:
    """The estimate of environments `ids` with who is unknown, for how long nobody was seen, and
    where they were then.

    Args:
        known: of the whole batch, goes on by a step in place.
        views: (B, C, W, ...) what cameras showed, as it came and worker by worker.
        looked: (B, C) which cameras looked over whole images, how old these are [s], and how many
            looks say that nobody is there.
    """
    unknown, blind_s = np.empty(estimate.tracked.shape, bool), np.empty(estimate.tracked.shape)
    seen_world = np.empty_like(estimate.mean_world)
    seen = tuple(each.confidence for each in views)
    belief = estimate.tracked, estimate.age_s.min(-1), estimate.mean_world
    times = dt_s, config.lost_after_s - 1e-9, FORGOTTEN * config.forget_s
    _note(known, ids, belief, seen, looked, times, (unknown, blind_s, seen_world))
    return replace(estimate, unknown=unknown, blind_s=blind_s, seen_world=seen_world)


@kernel
def _note(known, ids, belief, seen, looked, times, out):
    (slots, looks), (tracked, age_s, mean), (found, own) = known, belief, seen
    unknown, blind, seen_world = out
    for row in range(len(ids)):
        for w in range(tracked.shape[1]):
            slot, look = slots[ids[row], w], looks[ids[row], w]
            people = tracked[row].sum()
            shown = _look(look, row, w, people, (found, own), looked, times)
            if tracked[row, w]:
                if not slot.lost or age_s[row, w] < slot.blind_s + 0.5 * times[0]:
                    _copy(mean[row, w], slot.seen_world)
                slot.lost, slot.absent, slot.blind_s = True, False, age_s[row, w]
            else:
                _search(slot, look, shown, looked[2], times)
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
    """Count looks (C,) for a slot; whether a camera shows its worker, or more than so many people,
    who are tracked."""
    (dt, lost_after, _), (whole, image_age, _), (found, own) = times, looked, seen
    shown = False
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
def _search(slot, look, shown, enough, times):
    """What is known of a slot without a track."""
    dt, _, forgotten = times
    slot.blind_s += dt
    total, cameras, least, second = 0, 0, np.inf, np.inf
    for c in range(len(look)):
        if look[c].empty > 0:
            total, cameras = total + look[c].empty, cameras + 1
            second = min(second, max(least, look[c].since_s))
            least = min(least, look[c].since_s)
    hides = slot.lost and slot.blind_s < forgotten
    slot.absent = (
        not shown and cameras >= LEAST_CAMERAS and (slot.absent or (total >= enough and not hides))
    )
    if slot.absent:
        slot.lost, slot.blind_s = False, second
        for j in range(N_JOINTS):
            for i in range(3):
                slot.seen_world[j, i] = np.nan


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
