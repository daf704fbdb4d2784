"""People beyond the workers' slots: detected by searches, remembered, and handed a slot if near.

Searches of whole images go on while all workers are tracked: every `EVERY` steps, and more often
while there are other people. The slots belong to the people nearest to the robot.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hrc_env.core.batching import Stateful
from hrc_env.core.errors import needed
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Capsules, Ints, Points3
from hrc_env.core.vacancy import MOST_OTHERS, Others, no_others
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.geometry.distances import least_separation
from hrc_env.perception.searching import (
    Candidates,
    Sighting,
    same_person,
    sightings,
)
from hrc_env.pipeline.sensor_input import Windows

EVERY = 12
"""Steps between searches while all workers are tracked."""
APART_M = 0.35
"""Hips nearer than this to those of a tracked worker are theirs [m]."""
ROBOT_M = 0.15
"""No person's hips are nearer than this to the axis of a robot's link [m]."""
TAKEN_M = 0.45
"""A person who counted and is not found again is the worker whose track is nearer than this [m]."""
SAME_M, WALKED_M = 0.7, 0.07
"""A person is found again within this distance, and this more a step [m]."""
ALONE = 3
"""Searches in which one camera alone detects a person before that person counts."""
MISSES, MISSES_ALONE = 12, 4
"""Searches in a row without a person after which that person is forgotten, if they count and if
they do not."""
HIGHEST_M = 1.6
"""No person's hips are higher above the floor [m]."""
BESIDE = 0.4
"""A person detected by one camera alone within this share of the side of a worker's window may be
that worker."""
NEARER_M = 0.3
"""A person gets the slot of a worker who is farther from the robot by more than this [m]."""
GIVEN_UP = 6
"""Steps for which a worker is then searched for as if without a track: estimators begin anew after
three that contradict them."""
HIPS = [JOINT["left_hip"], JOINT["right_hip"]]


@dataclass(frozen=True, slots=True)
class Bystander:
    """A person beyond the slots."""

    hips_world: Points3
    """(3,) [m]."""
    age: int
    """Steps since they were detected."""
    seen: int
    """Searches that showed them."""
    missed: int
    """Searches in a row that did not."""
    counts: bool
    """Whether several cameras agreed on them, or one camera went on to detect them."""


class Bystanders(Stateful):
    """The people beyond the slots of W workers, for a batch of environments."""

    CHANGES = ("people", "since", "given_up")

    def __init__(self, batch: int, n_workers: int, cameras: Sequence[PinholeCamera]) -> None:
        self.cameras = tuple(cameras)
        self.people: list[list[Bystander]] = [[] for _ in range(batch)]
        self.since = np.zeros(batch, int)
        """(B,) steps since the last search."""
        self.given_up = np.zeros((batch, n_workers), int)
        """(B, W) steps for which a slot is given up to a person nearer to the robot."""

    def forget(self, b: int) -> None:
        """Begin environment b anew."""
        self.people[b], self.since[b], self.given_up[b] = [], 0, 0

    def others(self, ids: Ints, dt_s: float) -> Others:
        """Return the people who count, with steps of `dt_s` [s]."""
        others = no_others(len(ids))
        for row, b in enumerate(ids.tolist()):
            counted = [person for person in self.people[b] if person.counts]
            for n, person in enumerate(counted):
                others.hips_world[row, n] = person.hips_world
                others.age_s[row, n] = dt_s * person.age
        return others

    def tick(self, b: int) -> None:
        """Count a step of environment b."""
        self.people[b] = [replace(person, age=person.age + 1) for person in self.people[b]]
        self.since[b] += 1
        self.given_up[b] = np.maximum(self.given_up[b] - 1, 0)

    def due(self, b: int, often: int) -> bool:
        """Return whether to search the images of environment b in a step in which all workers are
        tracked; every `often` steps while there may be others."""
        return bool(self.since[b] >= (often if self.people[b] else EVERY))

    def nearest(self, found: Candidates, slots: int, robot_world: Capsules | None) -> Candidates:
        """Return people (C,), of more than there are free slots only those nearest to the robot's
        capsules (K, 2, 3)."""
        least = min(2, len(self.cameras))
        several = [one for one in sightings(found, self.cameras) if one.cameras >= least]
        if robot_world is None or len(several) <= slots:
            return found
        several.sort(key=lambda one: _away_m(one.hips_world, robot_world))
        windows = [[one.windows[c] for one in several[:slots]] for c in range(len(self.cameras))]
        return [[window for window in row if window is not None] for row in windows]

    def update(
        self,
        b: int,
        found: Candidates,
        taken: Windows,
        hips_world: Points3,
        robot_world: Capsules | None,
    ) -> list[Sighting]:
        """Take in a search of environment b; return the people beside the workers.

        Args:
            b: the environment.
            found: (C,) the people that were found.
            taken: windows (C,) in which workers were seen.
            hips_world: (W, 3) of the workers [m]; NaN without a track.
            robot_world: (K, 2, 3) the robot's capsules; None: it is not known.
        """
        beside = [
            one
            for one in sightings(_beside(found, taken), self.cameras)
            if not self._is_known(one, found, taken, hips_world, robot_world)
        ]
        left = list(beside)
        known = [_seen_again(person, left, hips_world) for person in self.people[b]]
        new = [Bystander(one.hips_world, 0, 1, 0, one.cameras > 1) for one in left]
        people = [person for person in (*known, *new) if person is not None]
        people.sort(key=lambda person: (not person.counts, person.age))
        self.people[b], self.since[b] = people[:MOST_OTHERS], 0
        if robot_world is not None:
            self._hand_over(b, hips_world, robot_world)
        return beside

    def _is_known(
        self,
        one: Sighting,
        found: Candidates,
        taken: Windows,
        hips_world: Points3,
        robot_world: Capsules | None,
    ) -> bool:
        """Return whether a sighting is of a worker, of the robot, or of no person.

        A camera alone that detects the worker as well, in another window, shows two people.
        """
        away_m = np.linalg.norm((hips_world - one.hips_world)[:, :2], axis=-1)
        if (away_m < APART_M).any():
            return True
        if one.cameras == 1 < len(self.cameras):
            if not 0.0 < one.hips_world[2] < HIGHEST_M:
                return True
            c = next(k for k, window in enumerate(one.windows) if window is not None)
            windows = [each[c] for each in taken]
            if any(same_person(other, window) for other in found[c] for window in windows):
                return False
            mine = needed(one.windows[c], "A window")
            return any(same_person(mine, window, BESIDE) for window in windows)
        return robot_world is not None and _away_m(one.hips_world, robot_world) < ROBOT_M

    def _hand_over(self, b: int, hips_world: Points3, robot_world: Capsules) -> None:
        """Give up the worker farthest from the robot if another person is nearer."""
        near = [
            _away_m(person.hips_world, robot_world)
            for person in self.people[b]
            if person.counts and person.age == 0
        ]
        away = [_away_m(hips, robot_world) for hips in hips_world]
        if near and np.isfinite(away).all() and min(near) < max(away) - NEARER_M:
            self.given_up[b, int(np.argmax(away))] = GIVEN_UP


def _beside(found: Candidates, taken: Windows) -> Candidates:
    """Return the people (C,) beside the workers, each of whom is one detection in a camera."""
    beside = [list(windows) for windows in found]
    for c, windows in enumerate(beside):
        for mine in (each[c] for each in taken):
            near = [window for window in windows if same_person(window, mine)]
            if mine is not None and near:
                off_px = [math.dist(window.centre_px, mine.centre_px) for window in near]
                windows.remove(near[int(np.argmin(off_px))])
    return beside


def _seen_again(person: Bystander, left: list[Sighting], hips_world: Points3) -> Bystander | None:
    """Find a remembered person among the sightings that are left, which loses theirs; None once the
    person is forgotten, or tracked: near the hips (W, 3) of a worker."""
    off_m = [math.dist(person.hips_world[:2], one.hips_world[:2]) for one in left]
    if min(off_m, default=math.inf) < SAME_M + WALKED_M * person.age:
        one = left.pop(int(np.argmin(off_m)))
        counts = person.counts or one.cameras > 1 or person.seen + 1 >= ALONE
        return Bystander(one.hips_world, 0, person.seen + 1, 0, counts)
    away_m = np.linalg.norm((hips_world - person.hips_world)[:, :2], axis=-1)
    most, near_m = (MISSES, TAKEN_M) if person.counts else (MISSES_ALONE, APART_M)
    if (away_m < near_m).any() or person.missed + 1 >= most:
        return None
    return replace(person, missed=person.missed + 1)


def _away_m(hips_world: Points3, robot_world: Capsules) -> float:
    """Return the distance of hips (3,) from the axes of capsules (K, 2, 3) [m]."""
    point = np.broadcast_to(hips_world, (1, 1, 1, 2, 3))
    capsules, radius = robot_world[None], np.zeros(len(robot_world))
    return float(least_separation(capsules, radius, point, np.zeros(1)).distance_m[0, 0])
