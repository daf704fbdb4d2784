"""The numbers in info: what each means, and what stands for one that was not measured.

Inside, a result holds NaN where there was nothing to measure. To users an info has the same keys
from the reset on, and no NaN: a distance to nobody is infinite, and beside a finite stand-in a key
says whether the number was measured. Words are indices; `worded` gives the words.
"""

import fnmatch
import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.brought import described
from hrc_env.core.errors import ConfigError, unknown
from hrc_env.core.typing import Ints

Info = dict[str, NDArray[Any]]
"""Numbers (B,) by name; NaN where an environment has none in this step."""
ABSENT = "absent"
"""The activity and the body of a worker who is not in the episode; as a number -1."""
ACTIVITY, BODY = "worker/activity", "worker/body"
CONTACT_KIND, CONTACT_REGION = "safety/contact_kind", "safety/contact_region"
WORDS = {
    ACTIVITY: "activity",
    BODY: "body",
    CONTACT_KIND: "contact_kind",
    CONTACT_REGION: "contact_region",
}
"""What `worded` says, and the name in `OF_WORKERS` of the indices behind it."""
PEOPLE = ("activity", "body")
"""Those that have a word for each worker."""
Words = dict[str, tuple[str, ...]]
_WORKER = re.compile(r"^worker_\d+/")
MISCALIBRATED = "perception/miscalibrated"
MORE_PEOPLE = "perception/more_people"
N_CAMERAS, MOVED, TURNED = "episode/n_cameras", "episode/moved_m", "episode/turned_rad"
DELAY, LIGHT, FAULT = "episode/delay_s", "episode/light", "episode/fault_"
"""Draws of an episode."""


class Entry(NamedTuple):
    """A number in info."""

    unit: str
    meaning: str
    stand_in: float | None = None
    """What stands for it where it was not measured; None: it always is."""
    flag: str | None = None
    """The key that says whether it was measured; None: another key or the stand-in does."""


CAME = "0 where no contact begins"
SHIELDED = "with `shield=`: "
ENTRIES: dict[str, Entry] = {
    "shield/change": Entry("rad/s", f"{SHIELDED}its change of the command, over all joints"),
    "shield/active": Entry("0 or 1", f"{SHIELDED}whether by more than 0.02 rad/s"),
    "shield/scale": Entry("-", f"{SHIELDED}what is left of the command along itself; 1: all"),
    "shield/clearance_m": Entry(
        "m", "built-in: least D, what is clear between robot and estimated bodies after margins, "
        "Z_d and the worker's travel; infinite where nothing near matters", np.inf,
    ),
    "shield/slack": Entry(
        "m/s", "built-in: by how much the worst row is exceeded, retreats not yet reached included"
    ),
    "shield/unknown": Entry(
        "0 or 1", "built-in: somebody may be there whom nobody sees: the speed is capped"
    ),
    "cost_proximity": Entry("0 or 1", "the true surfaces came nearer than `cost.proximity_m`"),
    "cost_contact": Entry(
        "0 or 1", "the true surfaces touched at any physics substep, by distance"
    ),
    "cost": Entry(
        "control steps", "sum of `cost.components`: by default 1 for a step nearer than "
        "`cost.proximity_m` and 1 for one that touches; 0 after a reset. There are also "
        "`towards`, contacts that begin while the robot comes; `force`, the "
        "`contact_force_ratio` of contacts; `too_near`; `near_miss`: each that is chosen is in "
        "`cost_<name>`",
    ),
    "cost_sum": Entry("control steps", "the same, under the name that some safe-RL libraries read"),
    "episode_cost": Entry("control steps", "running sum of `cost` over the episode"),
    "safety/min_separation_m": Entry(
        "m", "least true separation of the step; infinite without workers", np.inf
    ),
    "safety/robot_towards_m_s": Entry(
        "m/s", "how fast the robot's motion narrows the separation from the nearest worker; 0 "
        "beyond 1 m", 0.0, "safety/towards_measured",
    ),
    "safety/worker_towards_m_s": Entry(
        "m/s", "how fast the worker's does; likewise", 0.0, "safety/towards_measured"
    ),
    "safety/too_near": Entry(
        "0 or 1", "the robot comes towards a worker at more than 0.05 m/s, nearer than the "
        "protective distance of ISO/TS 15066 with both true directed speeds, 0.1 s of reaction and "
        "`time_to_stop_s`",
    ),
    "safety/time_to_stop_s": Entry("s", "until all joints stand still, at the fastest slew"),
    "safety/contact_came_m_s": Entry("m/s", f"the robot's directed speed before; {CAME}", 0.0),
    "safety/contact_closing_m_s": Entry("m/s", "that and the worker's own; likewise", 0.0),
    "safety/contact_force_ratio": Entry(
        "-", "force of ISO/TS 15066, A.3, at the closing speed, with half of the robot's moving "
        "mass and its load, as a share of the transient limit of the region; of the head, which "
        "has none, of its quasi-static one; likewise", 0.0,
    ),
    "safety/contact_severity": Entry(
        "0 to 3", "0: no contact begins, 1: one that the region bears, 2: one that it does not, 3: "
        "the head is hit",
    ),
    "safety/contacts_towards": Entry(
        "-", "contacts in the episode so far that began while the robot came towards the worker, "
        "at more than 0.05 m/s; who touches again within 0.5 s is in the same contact",
    ),
    "safety/contacts_fleeing": Entry("-", "likewise, while it went away"),
    "safety/contacts_standing": Entry("-", "likewise, while it did neither"),
    "safety/near_misses": Entry(
        "-", "how often in the episode so far the separation fell below 0.05 m and rose above "
        "0.10 m without a touch",
    ),
    "tracking/mpjpe_m": Entry(
        "m", "mean joint error of the estimate; -1 where nobody is tracked. Tracks are "
        "compared with the workers whom they fit best", -1.0, "tracking/mpjpe_measured",
    ),
    "tracking/mpjpe_by_identity_m": Entry(
        "m", "mean joint error of workers from the tracks that they were matched with last, "
        "wherever these are now; -1 without a match. It lasts while it is within 0.5 m (CLEAR MOT)",
        -1.0, "tracking/mpjpe_by_identity_measured",
    ),
    "tracking/id_switches": Entry(
        "-", "how often in this episode so far a worker was matched with another slot of the "
        "observation than the time before; two who are exchanged are two",
    ),
    "tracking/idf1": Entry(
        "0 to 1", "IDF1 of the episode so far: 2 m / n, m steps in which a worker and a track were "
        "within 0.5 m, each worker with one slot all along, n steps of workers and of tracks; -1 "
        "while n is 0", -1.0, "tracking/idf1_measured",
    ),
    "tracking/lost": Entry("0 or 1", "a worker is there who is not tracked"),
    "task/goals_reached": Entry("-", "goals of this episode reached so far"),
    "task/goals_missed": Entry("-", "goals of this episode that ran out of time"),
    "task/studs_placed": Entry("-", "pieces that rest in their places now, let go"),
    "task/studs_left": Entry("-", "pieces that do not"),
    "task/dropped": Entry("0 or 1", "a piece lies below the table, or the tool was lost"),
    "task/screws_driven": Entry("-", "screws that hold the board"),
    "task/screws_left": Entry("-", "screws that do not yet"),
    "task/worst_m": Entry(
        "m", "how far the board was off its place at most while screws were driven; -1 before",
        -1.0, "task/worst_measured",
    ),
    "task/worst_rad": Entry(
        "rad", "how far it was turned, likewise", -1.0, "task/worst_measured"
    ),
    "task/handed_over": Entry("0 or 1", "the worker has the tool, the robot let go and left it"),
    "task/not_handed_over": Entry("0 or 1", "the opposite"),
    "task/largest_n": Entry(
        "N", "the largest force that the worker's hand felt so far; 0 before", 0.0
    ),
    "task/delivered": Entry("0 or 1", "the base is in its zone, and nothing was hit on the way"),
    "task/not_delivered": Entry("0 or 1", "the opposite"),
    "task/fixed_hits": Entry("-", "how often the base began to touch what stands there"),
    "task/people_hits": Entry("-", "and a worker"),
    "task/way_left_m": Entry("m", "length of the way to its zone"),
    "is_success": Entry("0 or 1", "the task's success, as its page says"),
    MISCALIBRATED: Entry(
        "-", "number of cameras that contradict the others as if they had been moved, turned or "
        "zoomed; which of them: `perception/miscalibrated_<camera>`; at `pixels` and `keypoints`",
    ),
    MORE_PEOPLE: Entry(
        "0 or 1", "cameras detect more people than there are slots for workers, which makes all "
        "slots unknown; at `pixels` and `keypoints`",
    ),
    N_CAMERAS: Entry("-", "drawn: cameras that hang in this episode; at `pixels` and `keypoints`"),
    MOVED: Entry("m", "drawn: how far one hangs at most from where it was when made; likewise"),
    TURNED: Entry("rad", "drawn: how far one is turned at most; likewise"),
    DELAY: Entry("s", "drawn: how late images come at most, in whole control steps; likewise"),
    LIGHT: Entry("-", "drawn: strength of the light, 1 as built; likewise"),
}  # fmt: skip
"""By name; the reward's terms, workers' and cameras' own are not among them."""
OF_WORKERS: dict[str, str] = {
    "activity": "what worker N does, as an index; -1: not in the episode",
    "body": "which body worker N has, likewise",
    "contact_kind": "of the contact with worker N that begins in this step, what the robot did in "
    "the step before: 0 it came towards the worker, 1 it went away, 2 neither; -1: none begins",
    "contact_region": "which region of the body it hits, as an index; -1: none",
}
"""Meanings of `worker_N/NAME`, N from 0."""
OWN = Entry("-", "", 0.0)
"""A number that a task or shield of one's own gives."""
ALWAYS = ("reward/", "worker_", "cost_", f"{MISCALIBRATED}_", FAULT)
"""Names that begin so always have a value."""

OF_BELIEF = ("reward/", "shield/", "perception/")
"""Names that begin so are of what the robot believes."""


@cache
def entry_of(name: str) -> Entry:
    """Return what is known of a number by its name."""
    if name in ENTRIES:
        return ENTRIES[name]
    if name.startswith(ALWAYS):
        return Entry("-", "")
    return OWN._replace(flag=f"{name}_measured")


def published(info: Info) -> Info:
    """Return numbers (B,) without NaN, with the keys that say whether they were measured."""
    told: Info = {}
    for name, values in info.items():
        entry = entry_of(name)
        if entry.stand_in is None:
            told[name] = values
            continue
        known = values == values
        told[name] = np.where(known, values, entry.stand_in)
        if entry.flag is not None:
            told[entry.flag] = known.astype(float)
    return told


def is_of_belief(name: str) -> bool:
    """Return whether an info is of what the robot believes; all others are counted on the truth."""
    return name.startswith(OF_BELIEF)


def matching(patterns: str | Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of infos that patterns choose, in the order of the infos.

    Args:
        patterns: names, or patterns of names as of files: "safety/*"; one may stand alone.
        names: of all infos that there are.

    Raises:
        ConfigError: a pattern that is no text, or that no name matches, with the nearest name.
    """
    given = [patterns] if isinstance(patterns, str) else patterns
    if not isinstance(given, Sequence) or not all(isinstance(each, str) for each in given):
        raise ConfigError(
            'infos must be names or patterns of names, as ("cost", "safety/*"), got '
            f"{described(patterns)}."
        )
    for each in given:
        if not any(fnmatch.fnmatchcase(name, each) for name in names):
            folders = dict.fromkeys(f"{name.rpartition('/')[0]}/*" for name in names if "/" in name)
            raise unknown("info", each, [*folders, *names])
    return tuple(name for name in names if any(fnmatch.fnmatchcase(name, each) for each in given))


def of_workers(**parts: Ints) -> Info:
    """Return the numbers of each worker, of indices (B, W) by the names of `OF_WORKERS`."""
    return {
        f"worker_{w}/{name}": part[:, w].astype(np.int64)
        for name, part in parts.items()
        for w in range(part.shape[1])
    }


def worded(info: Mapping[str, Any], words: Mapping[str, Sequence[str]]) -> Words:
    """Return in words what the info of one environment says of workers and cameras.

    Args:
        info: of a reset or step of a single environment.
        words: by the names of `OF_WORKERS`, the words that the indices stand for.

    Returns:
        "worker/activity" and "worker/body": a name for each worker, "absent" of who is not in the
        episode. "safety/contact_kind" and "safety/contact_region": a name for each contact that
        begins in this step. "perception/miscalibrated": the names of cameras.
    """
    said: Words = {}
    for key, name in WORDS.items():
        numbers = [int(value) for k, value in info.items() if _WORKER.sub("", k) == name]
        told = [words[name][k] if k >= 0 else ABSENT for k in numbers]
        said[key] = tuple(each for each in told if name in PEOPLE or each != ABSENT)
    first = f"{MISCALIBRATED}_"
    named = (name for name in info if name.startswith(first) and info[name])
    said[MISCALIBRATED] = tuple(name.removeprefix(first) for name in named)
    return said
