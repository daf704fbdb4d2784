"""Searches of whole images: their schedule, and searches for workers with a wrong track.

A camera without people in its image is not searched again for some steps. If fewer than two cameras
have detected a tracked worker for some steps, the images of the other cameras are searched. If
these agree on a person, windows around that person are used until the track has moved there.
"""

from collections.abc import Collection, Sequence

import numpy as np

from hrc_env.core.batching import Stateful
from hrc_env.core.records import Roi
from hrc_env.core.typing import Bools
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.perception.searching import Candidates, Views, agreed_windows, exclude_people
from hrc_env.pipeline.sensor_input import Windows

REMEMBERED = 10
"""Number of steps for which the result of a camera's last search remains valid."""
PATIENCE = 8
"""Number of consecutive steps without a detection of a worker after which a camera's whole image
is searched."""
FOLLOWED = 5
"""Number of steps for which a window from a search is used. Estimators reinitialize a track after
three contradicting steps."""
ENOUGH = 2
"""Number of cameras that must detect a tracked worker to make a search unnecessary."""


class SearchSchedule(Stateful):
    """The schedule of searches of B environments with C cameras, and their recent results.

    Args:
        batch: number B of environments.
        n_cameras: number C of cameras.
        every: number of steps after which a camera without people is searched again.
    """

    CHANGES = ("rests", "ages", "people", "blank")

    def __init__(self, batch: int, n_cameras: int, every: int) -> None:
        self.every = every
        self.rests = np.zeros((batch, n_cameras), int)
        """(B, C) number of further steps for which a camera's image is not searched."""
        self.ages = np.full((batch, n_cameras), REMEMBERED)
        """(B, C) number of steps since a camera's image was searched, up to `REMEMBERED`."""
        self.people: list[list[list[Roi]]] = [[[] for _ in range(n_cameras)] for _ in range(batch)]
        """(B, C) windows of the people found by each camera's last search."""
        self.blank = np.zeros((batch, n_cameras), np.bool_)
        """(B, C) mask of the cameras with a blank image in their last search."""

    def reset(self, b: int) -> None:
        """Reset environment b."""
        self.rests[b], self.ages[b] = 0, REMEMBERED
        self.people[b] = [[] for _ in self.people[b]]

    def tick(self, b: int) -> None:
        """Advance the counters of environment b by a step."""
        self.rests[b] = np.maximum(self.rests[b] - 1, 0)
        self.ages[b] = np.minimum(self.ages[b] + 1, REMEMBERED)

    def due_cameras(self, b: int, has_image: Sequence[bool]) -> list[int]:
        """Return the indices of the cameras with images that are due to be searched."""
        return np.flatnonzero(np.array(has_image) & (self.rests[b] == 0)).tolist()

    def remember(
        self, b: int, cameras: Sequence[int], found: Candidates, blank: Collection[int] = ()
    ) -> Candidates:
        """Store the result of a search.

        Args:
            b: index of the environment.
            cameras: indices of the cameras that were searched.
            found: (C,) people that were found in the images of these cameras.
            blank: indices of the cameras with a blank image.

        Returns:
            (C,) windows of the people found by all recent searches.
        """
        for c in cameras:
            self.people[b][c], self.ages[b, c] = list(found[c]), 0
            self.blank[b, c] = c in blank
        recent = self.ages[b] < REMEMBERED
        return [people if recent[c] else [] for c, people in enumerate(self.people[b])]

    def rest(self, b: int) -> None:
        """Suspend searches of the cameras that have just been searched without finding a person."""
        self.rests[b, self.ages[b] == 0] = self.every


class Reacquisition(Stateful):
    """Searches for tracked workers that most cameras do not detect.

    Args:
        batch: number B of environments.
        n_workers: number W of workers.
        cameras: the rig.
    """

    CHANGES = ("unseen", "elsewhere", "left")

    def __init__(self, batch: int, n_workers: int, cameras: Sequence[PinholeCamera]) -> None:
        self.cameras = cameras
        self.unseen = np.zeros((batch, n_workers, len(cameras)), int)
        """(B, W, C) number of consecutive steps in which a camera has not detected the worker."""
        self.elsewhere: list[Windows] = [
            [[None] * len(cameras) for _ in range(n_workers)] for _ in range(batch)
        ]
        """(B, W, C) windows in which a search has found the worker."""
        self.left = np.zeros((batch, n_workers), int)
        """(B, W) number of further steps for which the windows of `elsewhere` are used."""

    def reset(self, b: int, worker: int) -> None:
        """Reset the searches for a worker of environment b."""
        self.unseen[b, worker], self.left[b, worker] = 0, 0
        self.elsewhere[b][worker] = [None] * self.unseen.shape[2]

    def blind_cameras(self, b: int, worker: int, has_image: Sequence[bool]) -> list[int]:
        """Return the indices of the cameras with images to be searched for a tracked worker."""
        missing = self.unseen[b, worker] >= PATIENCE
        if self.left[b, worker] or np.sum(~missing) >= min(ENOUGH, len(missing)):
            return []
        return np.flatnonzero(np.array(has_image) & missing).tolist()

    def learn(
        self, b: int, worker: int, people: Candidates, windows: Views, others: Windows
    ) -> None:
        """Process the result of a search for a worker in the images of `blind_cameras`.

        Args:
            b: index of the environment.
            worker: index of the worker.
            people: (C,) people that the search has found.
            windows: (C,) windows predicted by the track.
            others: windows (C,) of other workers, which are excluded.
        """
        blind = self.unseen[b, worker] >= PATIENCE
        candidates = [
            people[c] if blind[c] else [window for window in [windows[c]] if window is not None]
            for c in range(len(self.cameras))
        ]
        agreed = agreed_windows(exclude_people(candidates, others), self.cameras)
        self.unseen[b, worker, blind] = 0
        if any(agreed[c] is not None for c in np.flatnonzero(blind)):
            self.elsewhere[b][worker], self.left[b, worker] = agreed, FOLLOWED

    def choose_windows(self, b: int, worker: int, expected: Views) -> Views:
        """Return the windows (C,) of a worker from a recent search, or else from the track."""
        if not self.left[b, worker]:
            return expected
        self.left[b, worker] -= 1
        pairs = zip(self.elsewhere[b][worker], expected, strict=True)
        return [there if there is not None else here for there, here in pairs]

    def count(self, b: int, worker: int, shown: Bools) -> None:
        """Update the counters of a worker, given a mask (C,) of the cameras that detected it."""
        self.unseen[b, worker] = np.where(shown, 0, self.unseen[b, worker] + 1)
