"""Detection and memory of bystanders, that is, people that are not assigned to a worker slot.

While all workers are tracked, whole images are searched every `EVERY` steps, and more often while
there are bystanders. The slots are assigned to the people nearest to the robot.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hrc_env.core.batching import Stateful
from hrc_env.core.errors import require
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Capsules, Ints, Points3
from hrc_env.core.vacancy import MOST_OTHERS, Others, no_others
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.geometry.distances import least_separation
from hrc_env.perception.searching import (
    Candidates,
    Sighting,
    is_same_person,
    sightings,
)
from hrc_env.pipeline.sensor_input import Windows

EVERY = 12
"""Number of steps between searches while all workers are tracked."""
APART_M = 0.35
"""Distance from a tracked worker's hips below which detected hips belong to the worker [m]."""
ROBOT_M = 0.15
"""Distance from the axis of a robot's link below which detected hips are attributed to the robot
instead of a person [m]."""
TAKEN_M = 0.45
"""Distance from a worker's track below which a confirmed bystander that is not found again is
considered to be the worker [m]."""
SAME_M, WALKED_M = 0.7, 0.07
"""Maximum distance between two sightings of the same person, and its growth per step [m]."""
ALONE = 3
"""Number of searches after which a person detected by only one camera is confirmed."""
MISSES, MISSES_ALONE = 12, 4
"""Numbers of consecutive searches without a detection after which a confirmed person and an
unconfirmed person, respectively, are forgotten."""
HIGHEST_M = 1.6
"""Maximum height of a person's hips above the floor [m]."""
BESIDE = 0.4
"""Distance from the centre of a worker's window, as a fraction of the window's side, within which a
person detected by only one camera may be the worker."""
NEARER_M = 0.3
"""Difference of the distances from the robot above which a worker's slot is reassigned to a nearer
person [m]."""
GIVEN_UP = 6
"""Number of steps for which the track in a slot that is being reassigned is ignored while a search
for the nearer person is made. Estimators reinitialize a track after three contradicting steps."""
HIPS = [JOINT["left_hip"], JOINT["right_hip"]]
"""Indices of the hip joints; their midpoint is the position of a worker's hips."""


@dataclass(frozen=True, slots=True)
class Bystander:
    """A detected person that is not assigned to a worker slot."""

    hips_world: Points3
    """(3,) midpoint of the hips in the world frame [m]."""
    age: int
    """Number of steps since the last detection of the person."""
    n_seen: int
    """Number of searches that detected the person."""
    n_missed: int
    """Number of consecutive searches without a detection of the person, up to the most recent
    search."""
    is_confirmed: bool
    """Whether several cameras have agreed on the person, or a single camera has detected the person
    repeatedly."""


class Bystanders(Stateful):
    """The people that are not assigned to one of the W slots, for a batch of environments.

    Args:
        batch: number B of environments.
        n_workers: number W of slots.
        cameras: the rig.
    """

    CHANGES = ("people", "since", "given_up")

    def __init__(self, batch: int, n_workers: int, cameras: Sequence[PinholeCamera]) -> None:
        self.cameras = tuple(cameras)
        self.people: list[list[Bystander]] = [[] for _ in range(batch)]
        self.since = np.zeros(batch, int)
        """(B,) number of steps since the last search."""
        self.given_up = np.zeros((batch, n_workers), int)
        """(B, W) number of further steps for which a slot is being reassigned to a person nearer to
        the robot."""

    def forget(self, b: int) -> None:
        """Reset environment b."""
        self.people[b], self.since[b], self.given_up[b] = [], 0, 0

    def others(self, ids: Ints, dt_s: float) -> Others:
        """Return the confirmed bystanders of environments `ids`; a step lasts for `dt_s` [s]."""
        others = no_others(len(ids))
        for row, b in enumerate(ids.tolist()):
            confirmed = [person for person in self.people[b] if person.is_confirmed]
            for n, person in enumerate(confirmed):
                others.hips_world[row, n] = person.hips_world
                others.age_s[row, n] = dt_s * person.age
        return others

    def tick(self, b: int) -> None:
        """Advance the counters of environment b by a step."""
        self.people[b] = [replace(person, age=person.age + 1) for person in self.people[b]]
        self.since[b] += 1
        self.given_up[b] = np.maximum(self.given_up[b] - 1, 0)

    def is_search_due(self, b: int, often: int) -> bool:
        """Return whether a search of environment b is due while all workers are tracked.

        A search is due every `EVERY` steps, or every `often` steps while there may be bystanders.
        """
        return bool(self.since[b] >= (often if self.people[b] else EVERY))

    def select_nearest(
        self, found: Candidates, slots: int, robot_world: Capsules | None
    ) -> Candidates:
        """Select the people nearest to the robot, at most as many as there are free slots.

        Args:
            found: (C,) people in each camera.
            slots: number of free slots.
            robot_world: (K, 2, 3) the robot's capsules [m]; if None, all people are returned.
        """
        least = min(2, len(self.cameras))
        several = [one for one in sightings(found, self.cameras) if one.n_cameras >= least]
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
        """Update the bystanders with the result of a search, and return the sightings.

        Sightings of workers are not returned.

        Args:
            b: index of the environment.
            found: (C,) people in each camera.
            taken: windows (C,) in which workers were detected.
            hips_world: (W, 3) hips of the workers [m]; NaN for workers without a track.
            robot_world: (K, 2, 3) the robot's capsules [m]; None if they are unknown.
        """
        beside = [
            one
            for one in sightings(_exclude_workers(found, taken), self.cameras)
            if not self._is_known(one, found, taken, hips_world, robot_world)
        ]
        left = list(beside)
        known = [_update_person(person, left, hips_world) for person in self.people[b]]
        new = [Bystander(one.hips_world, 0, 1, 0, one.n_cameras > 1) for one in left]
        people = [person for person in (*known, *new) if person is not None]
        people.sort(key=lambda person: (not person.is_confirmed, person.age))
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
        """Return whether a sighting shows a worker, the robot, or no person.

        A sighting by only one camera shows another person if that camera also detects the worker
        in a different window. For the arguments see `update`.
        """
        away_m = np.linalg.norm((hips_world - one.hips_world)[:, :2], axis=-1)
        if (away_m < APART_M).any():
            return True
        if one.n_cameras == 1 < len(self.cameras):
            if not 0.0 < one.hips_world[2] < HIGHEST_M:
                return True
            c = next(k for k, window in enumerate(one.windows) if window is not None)
            windows = [each[c] for each in taken]
            if any(is_same_person(other, window) for other in found[c] for window in windows):
                return False
            mine = require(one.windows[c], "A window")
            return any(is_same_person(mine, window, BESIDE) for window in windows)
        return robot_world is not None and _away_m(one.hips_world, robot_world) < ROBOT_M

    def _hand_over(self, b: int, hips_world: Points3, robot_world: Capsules) -> None:
        """Reassign the slot of the worker farthest from the robot if a bystander is nearer."""
        near = [
            _away_m(person.hips_world, robot_world)
            for person in self.people[b]
            if person.is_confirmed and person.age == 0
        ]
        away = [_away_m(hips, robot_world) for hips in hips_world]
        if near and np.isfinite(away).all() and min(near) < max(away) - NEARER_M:
            self.given_up[b, int(np.argmax(away))] = GIVEN_UP


def _exclude_workers(found: Candidates, taken: Windows) -> Candidates:
    """Return the people (C,) other than workers, with one detection per person and camera."""
    beside = [list(windows) for windows in found]
    for c, windows in enumerate(beside):
        for mine in (each[c] for each in taken):
            near = [window for window in windows if is_same_person(window, mine)]
            if mine is not None and near:
                off_px = [math.dist(window.centre_px, mine.centre_px) for window in near]
                windows.remove(near[int(np.argmin(off_px))])
    return beside


def _update_person(
    person: Bystander, left: list[Sighting], hips_world: Points3
) -> Bystander | None:
    """Return a bystander after a search, or None if the person is forgotten or now tracked.

    Args:
        person: the bystander before the search.
        left: sightings that are not yet assigned to a person; the sighting of this person is
            removed.
        hips_world: (W, 3) hips of the workers [m]; NaN for workers without a track.
    """
    off_m = [math.dist(person.hips_world[:2], one.hips_world[:2]) for one in left]
    if min(off_m, default=math.inf) < SAME_M + WALKED_M * person.age:
        one = left.pop(int(np.argmin(off_m)))
        is_confirmed = person.is_confirmed or one.n_cameras > 1 or person.n_seen + 1 >= ALONE
        return Bystander(one.hips_world, 0, person.n_seen + 1, 0, is_confirmed)
    away_m = np.linalg.norm((hips_world - person.hips_world)[:, :2], axis=-1)
    most, near_m = (MISSES, TAKEN_M) if person.is_confirmed else (MISSES_ALONE, APART_M)
    if (away_m < near_m).any() or person.n_missed + 1 >= most:
        return None
    return replace(person, n_missed=person.n_missed + 1)


def _away_m(hips_world: Points3, robot_world: Capsules) -> float:
    """Return the distance of hips (3,) from the nearest axis of the capsules (K, 2, 3) [m]."""
    point = np.broadcast_to(hips_world, (1, 1, 1, 2, 3))
    capsules, radius = robot_world[None], np.zeros(len(robot_world))
    return float(least_separation(capsules, radius, point, np.zeros(1)).distance_m[0, 0])
