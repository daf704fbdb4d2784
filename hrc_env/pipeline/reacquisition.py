"""Workers whose windows show nobody while their track believes itself: where else they are.

A window goes where the track expects the worker. A track that has gone astray sends all of them
to where nobody is, and grows less sure only slowly. For whom fewer than two cameras have shown
for a while the whole images of the others are searched; where these agree on a person, they look
there for as long as an estimator takes to give up what it believed.
"""

from collections.abc import Sequence

from hrc_env.core.records import Roi
from hrc_env.core.stateful import Stateful
from hrc_env.core.typing import Bools
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.perception.acquisition import Candidates, agreed_windows, apart_from
from hrc_env.pipeline.sensor_input import Windows

PATIENCE = 8
"""Steps in a row in which a camera shows nobody before its whole image is searched."""
FOLLOWED = 5
"""Steps for which it then looks there: estimators begin anew after three that contradict them."""
ENOUGH = 2
"""So many cameras that show a worker hold the track where it is."""

Views = list[Roi | None]
"""A window a camera."""


class Reacquisition(Stateful):
    """Workers W of environments B before cameras C, and how long each camera has missed them."""

    CHANGES = ("unseen", "elsewhere", "left")

    def __init__(self, batch: int, n_workers: int, n_cameras: int) -> None:
        self.unseen = [[[0] * n_cameras for _ in range(n_workers)] for _ in range(batch)]
        """Steps in a row in which a camera showed nobody."""
        self.elsewhere: list[Windows] = [
            [[None] * n_cameras for _ in range(n_workers)] for _ in range(batch)
        ]
        """Where a search found them."""
        self.left = [[0] * n_workers for _ in range(batch)]
        """Steps for which they are still looked for there."""

    def reset(self, b: int, worker: int) -> None:
        """Begin with a worker of environment b anew."""
        n_cameras = len(self.unseen[b][worker])
        self.unseen[b][worker] = [0] * n_cameras
        self.elsewhere[b][worker], self.left[b][worker] = [None] * n_cameras, 0

    def blind(self, b: int, worker: int, has_image: Sequence[bool]) -> list[int]:
        """Cameras whose images are to be searched for a worker who is being followed."""
        unseen = self.unseen[b][worker]
        n_missing = sum(steps >= PATIENCE for steps in unseen)
        if self.left[b][worker] or len(unseen) - n_missing >= min(ENOUGH, len(unseen)):
            return []
        return [c for c, has in enumerate(has_image) if has and unseen[c] >= PATIENCE]

    def found(
        self,
        b: int,
        worker: int,
        people: Candidates,
        windows: Views,
        others: Windows,
        cameras: Sequence[PinholeCamera],
    ) -> None:
        """Learn what a search of the blind cameras gave.

        Args:
            b: which environment.
            worker: whom of it.
            people: (C,) whom each blind camera shows.
            windows: (C,) where the track has the cameras look.
            others: windows (C,) of other workers; they are not taken for this one.
            cameras: the rig.
        """
        unseen = self.unseen[b][worker]
        blind = [steps >= PATIENCE for steps in unseen]
        candidates = [
            people[c] if blind[c] else [window for window in [windows[c]] if window is not None]
            for c in range(len(cameras))
        ]
        agreed = agreed_windows(apart_from(candidates, others), cameras)
        self.unseen[b][worker] = [
            0 if is_blind else steps for is_blind, steps in zip(blind, unseen, strict=True)
        ]
        if any(
            window is not None for window, is_blind in zip(agreed, blind, strict=True) if is_blind
        ):
            self.elsewhere[b][worker], self.left[b][worker] = agreed, FOLLOWED

    def windows(self, b: int, worker: int, expected: Views) -> Views:
        """Where the cameras look: where a search has just found the worker, else as expected."""
        if not self.left[b][worker]:
            return expected
        self.left[b][worker] -= 1
        pairs = zip(self.elsewhere[b][worker], expected, strict=True)
        return [there if there is not None else here for there, here in pairs]

    def saw(self, b: int, worker: int, shown: Bools) -> None:
        """Count whom the cameras (C,) have shown in this step."""
        pairs = zip(self.unseen[b][worker], shown.tolist(), strict=True)
        self.unseen[b][worker] = [0 if is_shown else steps + 1 for steps, is_shown in pairs]
