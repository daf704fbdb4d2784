"""The numbers in info: their meanings, and substitutes for numbers that were not measured.

Internally, NaN marks a number that was not measured. Users receive infos with the same keys from
the reset on and without NaN: the distance to an absent worker is infinite, and if the substitute is
finite, another key states whether the number was measured. Names are encoded as indices, which
`name_indices` decodes.
"""

import fnmatch
import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.brought import describe
from hrc_env.core.errors import ConfigError, make_unknown_name_error
from hrc_env.core.renamed_keys import RenamedKeys, describe_renaming
from hrc_env.core.typing import Ints, is_sequence_of_text

Info = dict[str, NDArray[Any]]
"""Numbers (B,) by name; NaN for environments in which a number does not exist in this step."""
ABSENT = "absent"
"""Name of the activity and of the body of a worker that is not in the episode; the index is -1."""
ACTIVITY, BODY = "worker/activity", "worker/body"
CONTACT_KIND, CONTACT_REGION = "safety/contact_kind", "safety/contact_region"
WORDS = {
    ACTIVITY: "activity",
    BODY: "body",
    CONTACT_KIND: "contact_kind",
    CONTACT_REGION: "contact_region",
}
"""Keys that `name_indices` returns. The values are the names in `OF_WORKERS` of the indices that
are decoded."""
PEOPLE = ("activity", "body")
"""Names in `OF_WORKERS` of the indices that every worker has."""
Words = dict[str, tuple[str, ...]]
_WORKER = re.compile(r"^worker_\d+/")
MISCALIBRATED = "perception/miscalibrated"
MORE_PEOPLE = "perception/more_people_than_slots"
N_CAMERAS = "episode/n_cameras"
MOVED, TURNED = "episode/max_camera_shift_m", "episode/max_camera_rotation_rad"
DELAY, LIGHT, FAULT = "episode/delay_s", "episode/light", "episode/fault_"
"""Keys of properties that are sampled for each episode: delay, light, and the prefix for faults."""


RENAMED = {
    "cost_too_near": "cost_separation_violated",
    "episode/moved_m": MOVED,
    "episode/turned_rad": TURNED,
    "perception/more_people": MORE_PEOPLE,
    "safety/contact_came_m_s": "safety/contact_robot_speed_m_s",
    "safety/contact_closing_m_s": "safety/contact_closing_speed_m_s",
    "safety/too_near": "safety/separation_violated",
    "shield/least_m": "shield/clearance_m",
    "task/fixed_hits": "task/obstacle_collisions",
    "task/largest_n": "task/max_hand_force_n",
    "task/obstacle_hits": "task/obstacle_collisions",
    "task/people_hits": "task/worker_collisions",
    "task/screws_left": "task/screws_remaining",
    "task/studs_left": "task/studs_remaining",
    "task/way_left_m": "task/remaining_path_m",
    "task/worst_m": "task/max_offset_m",
    "task/worst_measured": "task/max_offset_measured",
    "task/worst_rad": "task/max_rotation_rad",
}
"""Current keys of renamed infos, by their former keys."""


class InfoDict(RenamedKeys):
    """Info of a reset or step, with errors that name the right key for a former or misspelt one."""

    KIND = "info key"
    RENAMED = RENAMED


class Entry(NamedTuple):
    """Description of a number in info."""

    unit: str
    """Unit or range of the number."""
    meaning: str
    """Meaning of the number, as the documentation prints it."""
    stand_in: float | None = None
    """Value that is published if the number was not measured; None if it always is measured."""
    flag: str | None = None
    """Key of the flag that states whether the number was measured; None if another key or the
    substitute shows it."""


CAME = "0 if no contact begins"
SHIELDED = "with `shield=`: "
ENTRIES: dict[str, Entry] = {
    "shield/change": Entry(
        "rad/s", f"{SHIELDED}length of the change of the joint velocities by the shield"
    ),
    "shield/active": Entry("0 or 1", f"{SHIELDED}whether that change exceeds 0.02 rad/s"),
    "shield/scale": Entry(
        "-",
        f"{SHIELDED}component of the allowed velocities along the command, as a share of the "
        "command's length; 1 if unchanged",
    ),
    "shield/clearance_m": Entry(
        "m",
        "built-in shields: smallest clearance D between the robot and estimated bodies, minus "
        "margins, Z_d and the worker's travel; infinite if no body is close enough for a "
        "constraint",
        np.inf,
    ),
    "shield/slack": Entry(
        "m/s",
        "built-in shields: largest violation of a constraint, including velocities of retreat that "
        "are not reached yet",
    ),
    "shield/unknown": Entry(
        "0 or 1",
        "built-in shields: whether a person whom no camera detects may be near, so that the speed "
        "is limited",
    ),
    "cost_proximity": Entry(
        "0 or 1", "whether the true surfaces came closer than `cost.proximity_m`"
    ),
    "cost_contact": Entry(
        "0 or 1",
        "whether the true surfaces touched in any physics substep, according to their distance",
    ),
    "cost_unsafe": Entry(
        "0 or 1",
        "whether the robot endangered a worker: it was closer than `cost.proximity_m` while it "
        "moved towards the worker at more than 0.05 m/s, moved into a contact, or fled too late "
        "from one above the force limit of the body region; 0 while it stands",
    ),
    "cost": Entry(
        "control steps",
        "sum of `cost.components`: by default `cost_unsafe`; 0 after a reset. Other components are "
        "`proximity`, `contact`, `towards` (contacts that begin while the robot moves towards the "
        "worker), `force` (the `contact_force_ratio` of contacts), `separation_violated` and "
        "`near_miss`. Each selected component also has a key `cost_<name>`",
    ),
    "cost_sum": Entry(
        "control steps", "equal to `cost`, under the key that some safe-RL libraries expect"
    ),
    "episode_cost": Entry("control steps", "sum of `cost` over the episode so far"),
    "safety/min_separation_m": Entry(
        "m", "smallest true separation in the step; infinite without workers", np.inf
    ),
    "safety/robot_towards_m_s": Entry(
        "m/s",
        "rate at which the robot's motion reduces the separation from the nearest worker; 0 beyond "
        "1 m",
        0.0,
        "safety/towards_measured",
    ),
    "safety/worker_towards_m_s": Entry(
        "m/s",
        "rate at which the nearest worker's motion reduces the separation; 0 beyond 1 m",
        0.0,
        "safety/towards_measured",
    ),
    "safety/separation_violated": Entry(
        "0 or 1",
        "whether the robot moves towards a worker at more than 0.05 m/s within the protective "
        "distance of ISO/TS 15066, computed from both true directed speeds, a reaction time of 0.1 "
        "s and `time_to_stop_s`",
    ),
    "safety/time_to_stop_s": Entry("s", "time until all joints stop, at their maximum slew rate"),
    "safety/contact_robot_speed_m_s": Entry(
        "m/s",
        "for a contact that begins: the speed of the robot's touching point towards the worker in "
        f"the previous step; {CAME}",
        0.0,
    ),
    "safety/contact_closing_speed_m_s": Entry(
        "m/s",
        f"for a contact that begins: that speed plus the worker's speed towards the robot; {CAME}",
        0.0,
    ),
    "safety/contact_recent_robot_speed_m_s": Entry(
        "m/s",
        f"for a contact that begins: that speed's maximum over the last five steps; {CAME}",
        0.0,
    ),
    "safety/contact_recent_closing_speed_m_s": Entry(
        "m/s",
        "for a contact that begins: maximum closing speed of the touching points over the contact "
        f"and the last five steps; {CAME}",
        0.0,
    ),
    "safety/contact_force_ratio": Entry(
        "-",
        "for a contact that begins: force by ISO/TS 15066, A.3, at the closing speed, with the "
        "robot's effective mass at the touching point, divided by the transient limit of the body "
        "region; for the head, which has no such limit, divided by the quasi-static one. If "
        "`contact_is_clamped`, at least the force at the robot's speed on a part that does not "
        f"recoil, divided by the quasi-static limit; {CAME}",
        0.0,
    ),
    "safety/contact_is_clamped": Entry(
        "0 or 1",
        "whether in a contact that begins the robot moves towards a part of a body that cannot "
        "yield, because a fixed shape or another link of the robot is behind it",
    ),
    "safety/contact_severity": Entry(
        "0 to 3",
        "severity of a contact that begins: 0 if none begins, 1 within the force limit of the body "
        "region, 2 above it, 3 on the head",
    ),
    "safety/contacts_towards": Entry(
        "-",
        "contacts in the episode so far that began while the robot moved towards the worker at "
        "more than 0.05 m/s; touches within 0.5 s count as one contact",
    ),
    "safety/contacts_fleeing": Entry(
        "-", "contacts in the episode so far that began while the robot moved away from the worker"
    ),
    "safety/contacts_standing": Entry(
        "-",
        "contacts in the episode so far that began while the robot moved neither towards the "
        "worker nor away",
    ),
    "safety/near_misses": Entry(
        "-",
        "number of times in the episode so far that the separation fell below 0.05 m and rose "
        "above 0.10 m again without a touch",
    ),
    "tracking/mpjpe_m": Entry(
        "m",
        "mean joint error of the estimate, where each track is compared with the best matching "
        "worker; -1 without a track",
        -1.0,
        "tracking/mpjpe_measured",
    ),
    "tracking/mpjpe_by_identity_m": Entry(
        "m",
        "mean joint error of each worker relative to the track with which they were last matched, "
        "however far apart; -1 without a match. A match is kept while it is within 0.5 m (CLEAR "
        "MOT)",
        -1.0,
        "tracking/mpjpe_by_identity_measured",
    ),
    "tracking/id_switches": Entry(
        "-",
        "number of times in the episode so far that a worker was matched with a different slot "
        "than before; a swap of two workers counts twice",
    ),
    "tracking/idf1": Entry(
        "0 to 1",
        "IDF1 of the episode so far, 2 m / n, where m is the number of steps in which a worker and "
        "a track were within 0.5 m, with one slot assigned to each worker throughout, and n the "
        "sum of the steps of workers and of tracks; -1 while n is 0",
        -1.0,
        "tracking/idf1_measured",
    ),
    "tracking/lost": Entry("0 or 1", "whether a worker is present without a track"),
    "task/goals_reached": Entry("-", "goals reached in the episode so far"),
    "task/goals_missed": Entry("-", "goals in the episode so far whose time limit expired"),
    "task/studs_placed": Entry("-", "pieces that rest at their target positions, released"),
    "task/studs_remaining": Entry("-", "pieces that are not at their target positions"),
    "task/dropped": Entry("0 or 1", "whether a piece lies below the table, or the tool was lost"),
    "task/screws_driven": Entry("-", "screws that hold the board"),
    "task/screws_remaining": Entry("-", "screws that have not been driven yet"),
    "task/max_offset_m": Entry(
        "m",
        "largest deviation of the board from its target position while screws were driven; -1 "
        "before",
        -1.0,
        "task/max_offset_measured",
    ),
    "task/max_rotation_rad": Entry(
        "rad",
        "largest rotation of the board from its target pose while screws were driven; -1 before",
        -1.0,
        "task/max_offset_measured",
    ),
    "task/handed_over": Entry(
        "0 or 1", "whether the worker has the tool and the robot has released it and moved away"
    ),
    "task/not_handed_over": Entry("0 or 1", "the negation of `task/handed_over`"),
    "task/max_hand_force_n": Entry(
        "N", "largest force on the worker's hand in the episode so far; 0 before any", 0.0
    ),
    "task/delivered": Entry(
        "0 or 1", "whether the base reached its zone without a collision on the way"
    ),
    "task/not_delivered": Entry("0 or 1", "the negation of `task/delivered`"),
    "task/obstacle_collisions": Entry("-", "number of collisions of the base with fixed objects"),
    "task/worker_collisions": Entry("-", "number of collisions of the base with workers"),
    "task/remaining_path_m": Entry("m", "length of the remaining path to the zone"),
    "is_success": Entry("0 or 1", "success, as defined on the page of the task"),
    MISCALIBRATED: Entry(
        "-",
        "number of cameras that contradict the others as if they had been moved, rotated or "
        "zoomed; `perception/miscalibrated_<camera>` is 1 for these; at `pixels` and `keypoints`",
    ),
    MORE_PEOPLE: Entry(
        "0 or 1",
        "whether cameras detect more people than there are slots for workers, which makes all "
        "slots unknown; at `pixels` and `keypoints`",
    ),
    N_CAMERAS: Entry("-", "drawn per episode: number of cameras; at `pixels` and `keypoints`"),
    MOVED: Entry(
        "m", "drawn per episode: largest displacement of a camera; at `pixels` and `keypoints`"
    ),
    TURNED: Entry(
        "rad", "drawn per episode: largest rotation of a camera; at `pixels` and `keypoints`"
    ),
    DELAY: Entry(
        "s",
        "drawn per episode: largest delay of images, rounded to whole control steps; at `pixels` "
        "and `keypoints`",
    ),
    LIGHT: Entry(
        "-",
        "drawn per episode: intensity of the light, 1 is the scene's default; at "
        "`pixels` and `keypoints`",
    ),
}
"""Descriptions of the numbers by key, without reward terms and the numbers of each worker and
camera."""
OF_WORKERS: dict[str, str] = {
    "activity": "index of the activity of worker N; -1 if the worker is not in the episode",
    "body": "index of the body of worker N; -1 if the worker is not in the episode",
    "contact_kind": "kind of the contact with worker N that begins in this step, by the robot's "
    "motion in the previous step: 0 towards the worker, 1 away, 2 neither; -1 if none begins",
    "contact_region": "index of the body region that this contact hits; -1 if there is none",
}
"""Meanings of the infos of worker N, which have the keys `worker_N/NAME`, by NAME; N is the
worker's index."""
OWN = Entry("-", "", 0.0)
"""Description of a number that a user's custom task or shield returns."""
ALWAYS = ("reward/", "worker_", "cost_", f"{MISCALIBRATED}_", FAULT)
"""Prefixes of keys that always have a value."""

OF_BELIEF = ("reward/", "shield/", "perception/")
"""Prefixes of keys of numbers that depend on the robot's belief."""


@cache
def entry_of(name: str) -> Entry:
    """Return the description of a number by its key."""
    if name in ENTRIES:
        return ENTRIES[name]
    if name.startswith(ALWAYS):
        return Entry("-", "")
    return OWN._replace(flag=f"{name}_measured")


def publish(info: Info) -> Info:
    """Return numbers (B,) without NaN, and the flags that state whether they were measured."""
    told: Info = {}
    stand_ins = _find_stand_ins(tuple(info))
    for name, values in info.items():
        if name not in stand_ins:
            told[name] = values
            continue
        flag, known = entry_of(name).flag, values == values
        told[name] = np.where(known, values, stand_ins[name])
        if flag is not None:
            told[flag] = known.astype(float)
    return told


@cache
def _find_stand_ins(names: tuple[str, ...]) -> dict[str, float]:
    """Return the values that are published for numbers that were not measured, by name."""
    found = {name: entry_of(name).stand_in for name in names}
    return {name: value for name, value in found.items() if value is not None}


def is_of_belief(name: str) -> bool:
    """Return whether an info depends on the robot's belief; all others describe the truth."""
    return name.startswith(OF_BELIEF)


def match_keys(patterns: str | Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """Return the keys of infos that match patterns, in the order of `names`.

    Args:
        patterns: keys, or patterns of keys as for file names ("safety/*"); a single one is
            permitted.
        names: the keys of all infos.

    Raises:
        ConfigError: a pattern is not a string or matches no key; the message names the nearest key.
    """
    given = [patterns] if isinstance(patterns, str) else patterns
    if not is_sequence_of_text(given):
        raise ConfigError(
            'infos must be names or patterns of names, such as ("cost", "safety/*"), got '
            f"{describe(patterns)}."
        )
    for each in given:
        if each in RENAMED:
            raise ConfigError(describe_renaming(InfoDict.KIND, each, RENAMED))
        if not any(fnmatch.fnmatchcase(name, each) for name in names):
            folders = dict.fromkeys(f"{name.rpartition('/')[0]}/*" for name in names if "/" in name)
            raise make_unknown_name_error("info", each, [*folders, *names])
    return tuple(name for name in names if any(fnmatch.fnmatchcase(name, each) for each in given))


def of_workers(**parts: Ints) -> Info:
    """Return one info per worker and name.

    The arguments are indices (B, W), named as in `OF_WORKERS`.
    """
    return {
        f"worker_{w}/{name}": part[:, w].astype(np.int64)
        for name, part in parts.items()
        for w in range(part.shape[1])
    }


def name_indices(info: Mapping[str, Any], words: Mapping[str, Sequence[str]]) -> Words:
    """Decode the indices in the info of one environment to words.

    Args:
        info: info of a reset or step of a single environment.
        words: sequences of words to which the indices refer, by the names in `OF_WORKERS`.

    Returns:
        "worker/activity" and "worker/body": a name for each worker, "absent" for one that is not in
        the episode. "safety/contact_kind" and "safety/contact_region": a name for each contact that
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
