"""Order of the workers' activities, as a graph of jobs at kinds of workplaces."""

import itertools
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from hrc_env.core.errors import ConfigError, make_unknown_name_error
from hrc_env.motion.state import ACTIVITY_NAMES, WAYS
from hrc_env.worker.props import PROP_NAMES
from hrc_env.world import WORKPLACE_KINDS

HERE = "here"
"""Value of `Job.at` for a job that is done at the worker's current location."""
ROUTES = ("walk", "push")
"""Values of `Job.by`, the way in which a worker goes to the workplace of a job."""
DONE_THERE = tuple(name for k, name in enumerate(ACTIVITY_NAMES) if k not in WAYS)
"""Names of the activities that a job can have."""
HIGHEST_M = 2.2
"""Maximum height at which hands work [m]."""


@dataclass(frozen=True, slots=True)
class Job:
    """A unit of work, with the jobs that may follow and their relative probabilities."""

    name: str
    """Name of the job, by which other jobs refer to it."""
    activity: str
    """Name of the activity, one of `DONE_THERE`."""
    at: str
    """Kind of the workplace, one of `WORKPLACE_KINDS`, or "here" for the current location."""
    then: tuple[tuple[str, float], ...] = ()
    """Names and weights of the jobs that may follow; the errand ends if there are none."""
    begins: float = 0.0
    """Relative probability that an errand begins with this job; 0 for never."""
    prop: str = "nothing"
    """Name of the prop that is picked up or used, or pushed on the way.

    If workers walk to the job, they do it where such a prop rests at a workplace of the kind `at`.
    """
    by: str = "walk"
    """Way in which the worker goes to the workplace: "walk", or "push" to push the prop there."""
    height_m: float = 0.0
    """Height of the work above the floor [m]; 0 for the workplace's height."""
    waits: bool = False
    """Whether the job waits for the task's signal, before which the previous job is repeated."""


JOBS: tuple[Job, ...] = (
    Job(
        "work with the robot",
        "reach",
        "robot",
        (
            ("work with the robot", 0.78),
            ("wait for the robot", 0.16),
            ("show where", 0.03),
            ("watch the robot", 0.03),
        ),
    ),
    Job("wait for the robot", "stand", "robot", (("work with the robot", 1.0),)),
    Job("watch the robot", "look round", "robot", (("work with the robot", 1.0),)),
    Job("show where", "point", "robot", (("work with the robot", 1.0),)),
    Job("fetch a board", "pick up", "pile", (("bring it to the wall", 1.0),), 1.0, "board"),
    Job("bring it to the wall", "set down", "wall", (("nail it", 0.6), ("screw it on", 0.4))),
    Job(
        "fetch a box",
        "pick up",
        "pile",
        (("put it on the bench", 0.6), ("put it on the floor", 0.4)),
        0.7,
        "box",
    ),
    Job("put it on the bench", "set down", "bench", (("work at the bench", 1.0),)),
    Job("put it on the floor", "set down", "floor", (("look about", 1.0),)),
    Job(
        "move a load",
        "lift",
        "floor",
        (("look about", 0.4), ("move a load", 0.3), ("work on the floor", 0.3)),
        0.6,
    ),
    Job(
        "nail it",
        "hammer",
        "wall",
        (("nail it", 0.3), ("measure the wall", 0.3), ("screw it on", 0.2), ("look about", 0.2)),
        0.5,
    ),
    Job(
        "screw it on",
        "drill",
        "wall",
        (("nail it", 0.3), ("measure the wall", 0.3), ("look about", 0.4)),
        0.4,
    ),
    Job(
        "measure the wall",
        "measure",
        "wall",
        (("nail it", 0.4), ("screw it on", 0.4), ("look about", 0.2)),
        0.5,
    ),
    Job(
        "work overhead",
        "drill overhead",
        "overhead",
        (("work overhead", 0.5), ("look about", 0.5)),
        0.6,
    ),
    Job(
        "work at the bench",
        "saw",
        "bench",
        (("work at the bench", 0.4), ("tidy the bench", 0.6)),
        0.5,
    ),
    Job(
        "tidy the bench",
        "reach",
        "bench",
        (("tidy the bench", 0.5), ("work at the bench", 0.3), ("look about", 0.2)),
        0.5,
    ),
    Job("work on the floor", "kneel", "floor", (("look about", 1.0),), 0.4),
    Job("look at the floor", "squat", "floor", (("look about", 1.0),), 0.3),
    Job("take the cart", "stand", "cart", (("bring the cart", 1.0),), 0.4, "cart"),
    Job("bring the cart", "look round", "cart", (("look about", 1.0),), 0.0, "cart", "push"),
    Job("climb up", "climb", "step", (("look about", 0.6), ("climb up", 0.4)), 0.3),
    Job(
        "stand about",
        "stand",
        "open",
        (("look about", 0.4), ("stand about", 0.3), ("do something", 0.3)),
        0.8,
    ),
    Job("do something", "reach", "open", (("stand about", 0.5), ("do something", 0.5)), 0.4),
    Job("look about", "look round", HERE),
)
"""Default jobs: wood framing beside a robot that holds the workpiece. The weights are estimates."""

_LOW = tuple(
    Job(name, activity, "robot", ((JOBS[0].name, 1.0),), height_m=height_m)
    for name, activity, height_m in (
        ("screw it on below", "drill", 0.35),
        ("nail it below", "hammer", 0.3),
        ("fit it below", "kneel", 0.25),
        ("sort what lies there", "squat", 0.2),
        ("lift what lies there", "lift", 0.0),
    )
)
"""Jobs at or below knee height, which are done kneeling, squatting or bent over."""
_BOARD = (
    Job("wait for the board", "stand", "robot", (("screw the board on", 1.0),)),
    Job("screw the board on", "screw", "task", (("step aside", 1.0),), waits=True),
    Job("step aside", "look round", "robot", (("step aside", 1.0),)),
)
"""Jobs of `HRCDrywall-v0`: helping the robot to fix a board."""
_TOOL = (
    Job("wait for the tool", "stand", "robot", (("take the tool", 1.0),)),
    Job("take the tool", "take", "task", (("go on", 1.0),), waits=True),
    Job("go on", "look round", "robot", (("go on", 1.0),)),
)
"""Jobs of `HRCHandover-v0`: receiving a tool from the robot."""
_STACK = (
    Job("look at the work", "look round", "robot", (("take from the stack", 1.0),)),
    Job("take from the stack", "pick up", "task", (("lay it down", 1.0),), 1.0, "stud"),
    Job(
        "lay it down",
        "set down",
        "bench",
        (("take from the stack", 0.9), ("look at the work", 0.1)),
    ),
)
"""Jobs of `HRCPickPlace-v0`: taking parts from the stack of the robot."""
WORK: dict[str, tuple[Job, ...]] = {
    "framing": JOBS,
    "low_work": (
        replace(JOBS[0], then=(*JOBS[0].then, *((job.name, 0.06) for job in _LOW))),
        *_LOW,
        *JOBS[1:],
    ),
    "drywall": _BOARD,
    "handover": _TOOL,
    "stack": _STACK,
}
"""Presets of jobs by name.

In "framing", workers stand upright at the robot; "low_work" adds jobs at its foot, with estimated
weights. The other presets belong to tasks in which workers participate.
"""


def check_jobs(jobs: Sequence[Job]) -> None:
    """Raise `ConfigError` for unknown names, numbers out of bounds, or no job at the robot."""
    names = [job.name for job in jobs]
    if len(set(names)) < len(names):
        raise ConfigError(f"Jobs must have different names, got {names}.")
    if not any(job.at == "robot" for job in jobs):
        raise ConfigError("At least one job must be at the robot: at='robot'.")
    for job in jobs:
        for noun, got, valid in (
            ("activity of", job.activity, DONE_THERE),
            ("kind of place of", job.at, (*WORKPLACE_KINDS, HERE)),
            ("prop of", job.prop, PROP_NAMES),
            ("way to", job.by, ROUTES),
            *(("job after", name, names) for name, _ in job.then),
        ):
            if got not in valid:
                raise make_unknown_name_error(f"{noun} {job.name!r}", got, valid)
        if not 0.0 <= job.height_m <= HIGHEST_M:
            raise ConfigError(
                f"{job.name!r}: height_m must be 0 to {HIGHEST_M} m, got {job.height_m}."
            )
        if job.begins < 0.0 or not all(weight > 0.0 for _, weight in job.then):
            raise ConfigError(
                f"{job.name!r}: begins must be 0 or more, weights must be > 0, got "
                f"{job.begins} and {job.then}."
            )


class Choice(NamedTuple):
    """A job that may be chosen, with its weight."""

    job: int
    """Index into the schedule's jobs."""
    share: float
    """Relative weight of the job; in a `Schedule`, the cumulative probability."""


@dataclass(frozen=True, slots=True, eq=False)
class Schedule:
    """Graph of the jobs for which a scene has workplaces."""

    jobs: tuple[Job, ...]
    """Jobs for which there are workplaces."""
    then: tuple[tuple[Choice, ...], ...]
    """Choices of jobs that may follow each job."""
    robot: int
    """Index of the first job at the robot."""
    begins: tuple[Choice, ...]
    """Choices of jobs with which errands away from the robot begin; possibly empty."""


def make_schedule(jobs: Sequence[Job], kinds: Collection[str]) -> Schedule:
    """Return the graph of the jobs at given kinds of workplaces, and of all jobs at the robot."""
    kept = tuple(job for job in jobs if job.at in (*kinds, "robot", HERE))
    index = {job.name: k for k, job in enumerate(kept)}
    then = tuple(
        _accumulate([Choice(index[name], weight) for name, weight in job.then if name in index])
        for job in kept
    )
    robot = next(k for k, job in enumerate(kept) if job.at == "robot")
    begins = [Choice(index[job.name], job.begins) for job in kept if job.begins > 0.0]
    return Schedule(kept, then, robot, _accumulate(begins))


def _accumulate(weights: list[Choice]) -> tuple[Choice, ...]:
    """Convert the weights of jobs to cumulative probabilities."""
    total = sum(weight for _, weight in weights)
    running = itertools.accumulate(weight / total for _, weight in weights)
    return tuple(Choice(k, share) for (k, _), share in zip(weights, running, strict=True))


def pick_job(choices: tuple[Choice, ...], draw: float) -> int:
    """Return the job that a random number in [0, 1) selects; `choices` must not be empty."""
    return next((job for job, share in choices if draw < share), choices[-1].job)
