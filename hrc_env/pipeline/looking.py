"""Detects every worker of a scene: windows where they are expected, searches, people missed."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hrc_env.core.batching import Stateful
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Bools, Capsules, Floats, Image, Ints, Points3
from hrc_env.geometry.cameras import PinholeCamera, project, projections
from hrc_env.perception.detector import Detection, DetectorConfig, PoseDetector
from hrc_env.perception.noise import ERROR, STANDING
from hrc_env.perception.outline import is_folded, posture_of
from hrc_env.perception.searching import Candidates, ImageSource, Sighting, Views, apart_from
from hrc_env.perception.windows import steady_window, window_from_joints
from hrc_env.pipeline.bystanders import HIPS, Bystanders
from hrc_env.pipeline.reacquisition import ENOUGH, Reacquisition, SearchSchedule
from hrc_env.pipeline.sensor_input import Windows


class Looking(Stateful):
    """Finds the workers of a batch of environments in a rig's images, wherever these are from."""

    CHANGES = ("detector", "windows", "schedule", "reacquisition", "bystanders", "unexplained")

    def __init__(
        self,
        batch: int,
        cameras: Sequence[PinholeCamera],
        n_workers: int,
        config: DetectorConfig,
        floor_world: Points3 | None = None,
        error: Floats = ERROR,
    ) -> None:
        """Searches are laid out for people who stand at points `floor_world` (N, 3) [m], if these
        are known; `error`, a calibration's `sigma`, says how far detections may be off."""
        self.cameras, self.n_workers = tuple(cameras), n_workers
        self.P = projections(self.cameras)
        self.detector = PoseDetector(self.cameras, config, floor_world, error)
        self.windows: list[Windows] = [
            [[None] * len(self.cameras) for _ in range(n_workers)] for _ in range(batch)
        ]
        self.schedule = SearchSchedule(batch, len(self.cameras), config.search_every)
        self.reacquisition = Reacquisition(batch, n_workers, self.cameras)
        self.bystanders = Bystanders(batch, n_workers, self.cameras)
        self.unexplained = np.zeros((batch, len(self.cameras)), np.bool_)
        """(B, C) whether a camera's last search found a person who is neither a worker nor one of
        the `bystanders`."""
        self.seen: dict[int, tuple[Views, list[Image | None]]] = {}
        """Windows and crops of each environment's first worker: for pictures, no state."""

    def look(
        self,
        source: ImageSource,
        expected: PoseEstimate,
        b: int,
        has_image: Sequence[bool],
        out: Keypoints,
        robot_world: Capsules | None = None,
    ) -> None:
        """Look for every worker of environment b: those with a window first; one search serves all
        the others. Who is in view of cameras without an image only is not looked for.

        Args:
            source: the images, of which cameras (C,) that `has_image` have one now.
            expected: where the tracker expects the workers, (W, ...).
            out: (C, W, ...) is filled.
            robot_world: the robot's capsules (K, 2, 3) [m]: of more people than slots those nearest
                to it get one. None: those who were followed first.
        """
        self.schedule.tick(b)
        self.bystanders.tick(b)
        wanted = [self._windows(expected, w) for w in range(self.n_workers)]
        taken: Windows = []
        people, nearest, missed = None, None, False
        for worker in sorted(range(len(wanted)), key=lambda w: not any(wanted[w])):
            steady = list(map(steady_window, self.windows[b][worker], wanted[worker]))
            windows = [w if has else None for w, has in zip(steady, has_image, strict=True)]
            if not any(has_image) or (any(steady) and not any(windows)):
                continue
            if any(windows):
                windows = self._followed(source, b, worker, windows, taken, has_image)
            elif people is None:
                due = self.schedule.due(b, has_image)
                people = self._search(source, b, due)
                vacant = self.n_workers - sum(map(any, wanted))
                others = apart_from(people, taken)
                nearest = self.bystanders.nearest(others, vacant, robot_world)
            track = self._track(b, worker)
            folded, posture = _expected_posture(expected, worker)
            seen = self.detector.detect(source, windows, track, taken, nearest, folded, posture)
            taken.append(seen.windows)
            shown = seen.confidence.max(-1) > 0.0
            self.reacquisition.saw(b, worker, shown)
            missed |= not any(windows) and shown.sum() < min(ENOUGH, len(shown))
            self._keep(b, worker, seen, has_image, out)
        if people is None and any(has_image) and self.bystanders.due(b, self.schedule.every):
            people = self._search(source, b, np.flatnonzero(has_image).tolist())
        if people is not None:
            hips = np.where(expected.tracked[:, None], expected.mean_world[:, HIPS].mean(1), np.nan)
            beside = self.bystanders.update(b, people, taken, hips, robot_world)
            self._explain(b, beside, bool(expected.tracked.all()))
        if missed:
            self.schedule.rest(b)

    def followed(self, ids: Ints, expected: PoseEstimate) -> PoseEstimate:
        """Return what is expected in environments `ids` without the tracks that are given up to
        people nearer to the robot."""
        given_up = self.bystanders.given_up[ids] > 0
        return (
            replace(expected, tracked=expected.tracked & ~given_up) if given_up.any() else expected
        )

    def looked(self, ids: Ints) -> Bools:
        """Return (B, C) the cameras of environments `ids` whose whole images were just searched and
        are not blank."""
        return (self.schedule.ages[ids] == 0) & ~self.schedule.blank[ids]

    def forget(self, b: int) -> None:
        """Forget whom environment b was following."""
        self.unexplained[b] = False
        self.schedule.reset(b)
        self.bystanders.forget(b)
        for worker in range(self.n_workers):
            self.detector.forget(self._track(b, worker))
            self.reacquisition.reset(b, worker)
            self.windows[b][worker] = [None] * len(self.cameras)

    def crops(self, b: int) -> list[Image | None]:
        """What the network was given of the first worker of environment b."""
        windows, crops = self.seen.get(b, ([], []))
        current = self.windows[b][0] if self.windows[b] else []
        return crops if windows == current else [None] * len(current)

    def _search(self, source: ImageSource, b: int, cameras: Sequence[int]) -> Candidates:
        """Search the images of cameras; return the people (C,) of all recent searches."""
        found = self.detector.search(source, cameras)
        return self.schedule.remember(b, cameras, found, self.detector.blank)

    def _explain(self, b: int, beside: Sequence[Sighting], no_vacancy: bool) -> None:
        """Note the searched cameras that show a person `beside` the workers; with `no_vacancy` only
        one on whom no other camera agrees."""
        for c in np.flatnonzero(self.schedule.ages[b] == 0).tolist():
            shown = [one for one in beside if one.windows[c] is not None]
            self.unexplained[b, c] = any(one.cameras == 1 or not no_vacancy for one in shown)

    def _keep(
        self, b: int, worker: int, seen: Detection, has_image: Sequence[bool], out: Keypoints
    ) -> None:
        out.px[:, worker], out.confidence[:, worker] = seen.px, seen.confidence
        out.sigma_px[:, worker] = seen.sigma_px
        for c, has in enumerate(has_image):
            if has:
                self.windows[b][worker][c] = seen.windows[c]
        if worker == 0:
            self.seen[b] = list(seen.windows), seen.crops

    def _followed(
        self,
        source: ImageSource,
        b: int,
        worker: int,
        windows: Views,
        taken: Windows,
        has_image: Sequence[bool],
    ) -> Views:
        """Where to look for a worker with a track: elsewhere if most cameras have missed them."""
        blind = self.reacquisition.blind(b, worker, has_image)
        if blind:
            people = self.detector.search(source, blind)
            self.reacquisition.found(b, worker, people, windows, taken)
        there = self.reacquisition.windows(b, worker, windows)
        return [window if has else None for window, has in zip(there, has_image, strict=True)]

    def _track(self, b: int, worker: int) -> int:
        """The number by which the detector knows a worker of an environment."""
        return b * self.n_workers + worker

    def _windows(self, predicted: PoseEstimate, worker: int) -> Views:
        """A window a camera; None where the worker is unknown or out of view: search."""
        if not predicted.tracked[worker]:
            return [None] * len(self.cameras)
        px, depth_m = project(self.P, predicted.mean_world[worker : worker + 1])
        return list(map(window_from_joints, px[0], depth_m[0], self.cameras))


def _expected_posture(expected: PoseEstimate, worker: int) -> tuple[bool, Sequence[float]]:
    """Whether a worker is expected to be folded up; how far they count as each posture."""
    if not expected.tracked[worker]:
        return False, STANDING
    joints = expected.mean_world[worker]
    return is_folded(joints), posture_of(joints, expected.velocity_world[worker])
