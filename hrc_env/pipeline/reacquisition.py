"""Searches of whole images: when they are due, and for workers whose track has gone astray.

A camera in whose image nobody was believed rests for a while. Where fewer than two cameras have
shown a tracked worker for some steps, the images of the others are searched; where these agree on a
person, they look there until the estimator follows.
"""

from collections.abc import Collection, Sequence

import numpy as np

from hrc_env.core.batching import Stateful
from hrc_env.core.records import Roi
from hrc_env.core.typing import Bools
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.perception.searching import Candidates, Views, agreed_windows, apart_from
from hrc_env.pipeline.sensor_input import Windows

REMEMBERED = 10
"""Steps for which what a search found stands for a camera that is not searched."""
PATIENCE = 8
"""Steps in a row in which a camera shows nobody before its whole image is searched."""
FOLLOWED = 5
"""Steps for which it then looks there: estimators begin anew after three that contradict them."""
ENOUGH = 2
"""So many cameras that show a worker hold the track where it is."""


class SearchSchedule(Stateful):
    """When B environments search the images of C cameras, and what these showed lately."""

    CHANGES = ("rests", "ages", "people", "blank")

    def __init__(self, batch: int, n_cameras: int, every: int) -> None:
        """A camera is searched again `every` steps after nobody was believed."""
        self.every = every
        self.rests = np.zeros((batch, n_cameras), int)
        """(B, C) steps for which a camera is not searched."""
        self.ages = np.full((batch, n_cameras), REMEMBERED)
        """(B, C) steps since a camera was searched, up to `REMEMBERED`."""
        self.people: list[list[list[Roi]]] = [[[] for _ in range(n_cameras)] for _ in range(batch)]
        """The people that each camera found then."""
        self.blank = np.zeros((batch, n_cameras), np.bool_)
        """(B, C) whether the image was blank."""

    def reset(self, b: int) -> None:
        """Begin environment b anew."""
        self.rests[b], self.ages[b] = 0, REMEMBERED
        self.people[b] = [[] for _ in self.people[b]]

    def tick(self, b: int) -> None:
        """Count a step of environment b."""
        self.rests[b] = np.maximum(self.rests[b] - 1, 0)
        self.ages[b] = np.minimum(self.ages[b] + 1, REMEMBERED)

    def due(self, b: int, has_image: Sequence[bool]) -> list[int]:
        """The cameras whose images are to be searched now."""
        return np.flatnonzero(np.array(has_image) & (self.rests[b] == 0)).tolist()

    def remember(
        self, b: int, cameras: Sequence[int], found: Candidates, blank: Collection[int] = ()
    ) -> Candidates:
        """Keep the people (C,) that these cameras have just found, and the `blank` cameras; return
        them with those of other recent searches."""
        for c in cameras:
            self.people[b][c], self.ages[b, c] = list(found[c]), 0
            self.blank[b, c] = c in blank
        recent = self.ages[b] < REMEMBERED
        return [people if recent[c] else [] for c, people in enumerate(self.people[b])]

    def rest(self, b: int) -> None:
        """Nobody was believed: the cameras that were searched now are left alone for a while."""
        self.rests[b, self.ages[b] == 0] = self.every


class Reacquisition(Stateful):
    """Workers W of environments B before cameras C, and how long each camera has missed them."""

    CHANGES = ("unseen", "elsewhere", "left")

    def __init__(self, batch: int, n_workers: int, cameras: Sequence[PinholeCamera]) -> None:
        self.cameras = cameras
        self.unseen = np.zeros((batch, n_workers, len(cameras)), int)
        """(B, W, C) steps in a row in which a camera showed nobody."""
        self.elsewhere: list[Windows] = [
            [[None] * len(cameras) for _ in range(n_workers)] for _ in range(batch)
        ]
        """Where a search found them."""
        self.left = np.zeros((batch, n_workers), int)
        """(B, W) steps for which they are still looked for there."""

    def reset(self, b: int, worker: int) -> None:
        """Begin with a worker of environment b anew."""
        self.unseen[b, worker], self.left[b, worker] = 0, 0
        self.elsewhere[b][worker] = [None] * self.unseen.shape[2]

    def blind(self, b: int, worker: int, has_image: Sequence[bool]) -> list[int]:
        """Cameras whose images are to be searched for a worker who is being followed."""
        missing = self.unseen[b, worker] >= PATIENCE
        if self.left[b, worker] or np.sum(~missing) >= min(ENOUGH, len(missing)):
            return []
        return np.flatnonzero(np.array(has_image) & missing).tolist()

    def found(
        self, b: int, worker: int, people: Candidates, windows: Views, others: Windows
    ) -> None:
        """Learn whom (C,) a search of the blind cameras shows for a worker of environment b, where
        the track has cameras look (C,), and windows (C,) of others, whom it is not."""
        blind = self.unseen[b, worker] >= PATIENCE
        candidates = [
            people[c] if blind[c] else [window for window in [windows[c]] if window is not None]
            for c in range(len(self.cameras))
        ]
        agreed = agreed_windows(apart_from(candidates, others), self.cameras)
        self.unseen[b, worker, blind] = 0
        if any(agreed[c] is not None for c in np.flatnonzero(blind)):
            self.elsewhere[b][worker], self.left[b, worker] = agreed, FOLLOWED

    def windows(self, b: int, worker: int, expected: Views) -> Views:
        """Where the cameras look: where a search has just found the worker, else as expected."""
        if not self.left[b, worker]:
            return expected
        self.left[b, worker] -= 1
        pairs = zip(self.elsewhere[b][worker], expected, strict=True)
        return [there if there is not None else here for there, here in pairs]

    def saw(self, b: int, worker: int, shown: Bools) -> None:
        """Count whom the cameras (C,) have shown in this step."""
        self.unseen[b, worker] = np.where(shown, 0, self.unseen[b, worker] + 1)
