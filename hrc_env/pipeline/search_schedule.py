"""When whole images are searched, and what they showed a moment ago.

A search costs as much as several steps, most of all with bad images: a camera in whose image nobody
was believed is searched again some steps later. A track begins with two cameras that agree; where
images come at different times, a camera's last one stands for it for a while.
"""

from collections.abc import Sequence

from hrc_env.core.records import Roi
from hrc_env.core.stateful import Stateful
from hrc_env.perception.acquisition import Candidates

REMEMBERED = 10
"""Steps for which what a search found stands for a camera that is not searched: 0.4 s, in which
hips hardly move further than two lines of sight may pass each other by."""


class SearchSchedule(Stateful):
    """The searches of B environments with C cameras."""

    CHANGES = ("rests", "ages", "people")

    def __init__(self, batch: int, n_cameras: int, every: int) -> None:
        """A camera is searched again `every` steps after nobody was believed."""
        self.every = every
        self.rests = [[0] * n_cameras for _ in range(batch)]
        """Steps for which a camera is not searched."""
        self.ages = [[REMEMBERED] * n_cameras for _ in range(batch)]
        """Steps since a camera was searched, up to `REMEMBERED`."""
        self.people: list[list[list[Roi]]] = [[[] for _ in range(n_cameras)] for _ in range(batch)]
        """Whom each camera showed then."""

    def reset(self, b: int) -> None:
        """Begin environment b anew."""
        n = len(self.rests[b])
        self.rests[b], self.ages[b], self.people[b] = [0] * n, [REMEMBERED] * n, [[]] * n

    def tick(self, b: int) -> None:
        """Count a step of environment b."""
        self.rests[b] = [max(rest - 1, 0) for rest in self.rests[b]]
        self.ages[b] = [min(age + 1, REMEMBERED) for age in self.ages[b]]

    def due(self, b: int, has_image: Sequence[bool]) -> list[int]:
        """The cameras whose images are to be searched now."""
        pairs = enumerate(zip(has_image, self.rests[b], strict=True))
        return [c for c, (has, rest) in pairs if has and rest == 0]

    def remember(self, b: int, cameras: Sequence[int], found: Candidates) -> Candidates:
        """Keep what these cameras showed, and give it with what the others showed lately.

        Args:
            b: which environment.
            cameras: those that were searched.
            found: (C,) whom each showed; of the others, nothing.
        """
        for c in cameras:
            self.people[b][c], self.ages[b][c] = list(found[c]), 0
        pairs = zip(self.people[b], self.ages[b], strict=True)
        return [people if age < REMEMBERED else [] for people, age in pairs]

    def rest(self, b: int) -> None:
        """Nobody was believed: the cameras that were searched now are left alone for a while."""
        pairs = zip(self.rests[b], self.ages[b], strict=True)
        self.rests[b] = [self.every if age == 0 else rest for rest, age in pairs]
