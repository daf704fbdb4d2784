"""Detection of the workers of a scene, in windows at predicted positions and by searches."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hrc_env.core.batching import Stateful
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Bools, Capsules, Floats, Image, Ints, Points3
from hrc_env.geometry.cameras import PinholeCamera, project, projections
from hrc_env.perception.detector import Detection, DetectorConfig, PoseDetector
from hrc_env.perception.noise import ERROR
from hrc_env.perception.outline import STANDING, is_folded, posture_of
from hrc_env.perception.searching import Candidates, ImageSource, Sighting, Views, exclude_people
from hrc_env.perception.windows import steady_window, window_from_joints
from hrc_env.pipeline.bystanders import HIPS, Bystanders
from hrc_env.pipeline.reacquisition import ENOUGH, Reacquisition, SearchSchedule
from hrc_env.pipeline.sensor_input import Windows


class ExpectedPosture(NamedTuple):
    """The posture that a worker is expected to have."""

    is_folded: bool
    """Whether the worker is expected to bend, squat or kneel (`outline.is_folded`)."""
    shares: Sequence[float]
    """Weights of the postures (`outline.Posture`)."""


class Crops(NamedTuple):
    """The last crops of a worker, which are used in pictures."""

    windows: Views
    """(C,) window of each camera."""
    images: list[Image | None]
    """(C,) crop of each window, as it was passed to the network."""


class WorkerDetector(Stateful):
    """A detector of the workers of a batch of environments in the images of a rig.

    Tracked workers are detected in windows at their predicted positions, and other workers by
    searches of whole images.

    Args:
        batch: number B of environments.
        cameras: the rig.
        n_workers: number W of workers.
        config: settings of the detector.
        floor_world: (N, 3) points where people may stand, for the layout of searches [m]; None if
            they are unknown.
        error: table `sigma` of a calibration, which gives the reported standard deviations.
    """

    CHANGES = ("pose_detector", "windows", "schedule", "reacquisition", "bystanders", "unexplained")

    def __init__(
        self,
        batch: int,
        cameras: Sequence[PinholeCamera],
        n_workers: int,
        config: DetectorConfig,
        floor_world: Points3 | None = None,
        error: Floats = ERROR,
    ) -> None:
        self.cameras, self.n_workers = tuple(cameras), n_workers
        self.P = projections(self.cameras)
        self.pose_detector = PoseDetector(self.cameras, config, floor_world, error)
        self.windows: list[Windows] = [
            [[None] * len(self.cameras) for _ in range(n_workers)] for _ in range(batch)
        ]
        self.schedule = SearchSchedule(batch, len(self.cameras), config.search_every)
        self.reacquisition = Reacquisition(batch, n_workers, self.cameras)
        self.bystanders = Bystanders(batch, n_workers, self.cameras)
        self.unexplained = np.zeros((batch, len(self.cameras)), np.bool_)
        """(B, C) mask of the cameras in which the last search found a person other than the workers
        and the `bystanders`."""
        self.last_crops: dict[int, Crops] = {}
        """Last crops of the first worker, by environment, for pictures; they are not part of the
        state."""

    def detect(
        self,
        source: ImageSource,
        expected: PoseEstimate,
        b: int,
        has_image: Sequence[bool],
        out: Keypoints,
        robot_world: Capsules | None = None,
    ) -> None:
        """Detect every worker of environment b.

        Workers with a window are detected first; all others are detected by a single search.
        Workers that are in view only of cameras without an image are skipped.

        Args:
            source: the present images.
            expected: (W, ...) prediction of the tracker.
            b: index of the environment.
            has_image: (C,) whether each camera has an image now.
            out: (C, W, ...) keypoints, which are filled in.
            robot_world: (K, 2, 3) capsules of the robot [m]. If there are more people than slots,
                those nearest to the robot are assigned to a slot. If it is None, people that are
                already tracked have priority.
        """
        self.schedule.tick(b)
        self.bystanders.tick(b)
        predicted = [self._predict_windows(expected, w) for w in range(self.n_workers)]
        taken: Windows = []
        people, nearest, missed = None, None, False
        for worker in sorted(range(len(predicted)), key=lambda w: not any(predicted[w])):
            steady = list(map(steady_window, self.windows[b][worker], predicted[worker]))
            windows = [w if has else None for w, has in zip(steady, has_image, strict=True)]
            if not any(has_image) or (any(steady) and not any(windows)):
                continue
            if any(windows):
                windows = self._choose_windows(source, b, worker, windows, taken, has_image)
            elif people is None:
                people = self._search(source, b, self.schedule.due_cameras(b, has_image))
                vacant = self.n_workers - sum(map(any, predicted))
                others = exclude_people(people, taken)
                nearest = self.bystanders.select_nearest(others, vacant, robot_world)
            track = self._track(b, worker)
            folded, posture = _expected_posture(expected, worker)
            seen = self.pose_detector.detect(
                source, windows, track, taken, nearest, folded, posture
            )
            taken.append(seen.windows)
            shown = seen.confidence.max(-1) > 0.0
            self.reacquisition.count(b, worker, shown)
            missed |= not any(windows) and shown.sum() < min(ENOUGH, len(shown))
            self._keep(b, worker, seen, has_image, out)
        is_due = self.bystanders.is_search_due(b, self.schedule.every)
        if people is None and any(has_image) and is_due:
            people = self._search(source, b, np.flatnonzero(has_image).tolist())
        if people is not None:
            hips = np.where(expected.tracked[:, None], expected.mean_world[:, HIPS].mean(1), np.nan)
            beside = self.bystanders.update(b, people, taken, hips, robot_world)
            self._explain(b, beside, bool(expected.tracked.all()))
        if missed:
            self.schedule.rest(b)

    def drop_given_up(self, ids: Ints, expected: PoseEstimate) -> PoseEstimate:
        """Return a prediction for environments `ids` without tracks in reassigned slots.

        Slots are reassigned to people that are nearer to the robot.
        """
        given_up = self.bystanders.given_up[ids] > 0
        return (
            replace(expected, tracked=expected.tracked & ~given_up) if given_up.any() else expected
        )

    def searched_cameras(self, ids: Ints) -> Bools:
        """Return a mask (B, C) of cameras with an image that was just searched and is not blank."""
        return (self.schedule.ages[ids] == 0) & ~self.schedule.blank[ids]

    def forget(self, b: int) -> None:
        """Delete all data about the workers of environment b."""
        self.unexplained[b] = False
        self.schedule.reset(b)
        self.bystanders.forget(b)
        for worker in range(self.n_workers):
            self.pose_detector.forget(self._track(b, worker))
            self.reacquisition.reset(b, worker)
            self.windows[b][worker] = [None] * len(self.cameras)

    def crops(self, b: int) -> list[Image | None]:
        """Return the last crop (C,) of the first worker of environment b in each camera."""
        windows, crops = self.last_crops.get(b, Crops([], []))
        current = self.windows[b][0] if self.windows[b] else []
        return crops if windows == current else [None] * len(current)

    def close(self) -> None:
        """Stop the threads of the networks."""
        self.pose_detector.close()

    def _search(self, source: ImageSource, b: int, cameras: Sequence[int]) -> Candidates:
        """Search the images of cameras, and return the people (C,) found by all recent searches."""
        found = self.pose_detector.search(source, cameras)
        return self.schedule.remember(b, cameras, found, self.pose_detector.blank)

    def _explain(self, b: int, beside: Sequence[Sighting], no_vacancy: bool) -> None:
        """Update `unexplained` for the cameras that have been searched.

        Args:
            b: index of the environment.
            beside: sightings of people other than the workers.
            no_vacancy: whether all slots are tracked; in that case, a person is unexplained only if
                detected by a single camera.
        """
        for c in np.flatnonzero(self.schedule.ages[b] == 0).tolist():
            shown = [one for one in beside if one.windows[c] is not None]
            self.unexplained[b, c] = any(one.n_cameras == 1 or not no_vacancy for one in shown)

    def _keep(
        self, b: int, worker: int, seen: Detection, has_image: Sequence[bool], out: Keypoints
    ) -> None:
        """Copy the detection of a worker to the keypoints (C, W, ...), and store its windows."""
        out.px[:, worker], out.confidence[:, worker] = seen.px, seen.confidence
        out.sigma_px[:, worker] = seen.sigma_px
        for c, has in enumerate(has_image):
            if has:
                self.windows[b][worker][c] = seen.windows[c]
        if worker == 0:
            self.last_crops[b] = Crops(list(seen.windows), seen.crops)

    def _choose_windows(
        self,
        source: ImageSource,
        b: int,
        worker: int,
        windows: Views,
        taken: Windows,
        has_image: Sequence[bool],
    ) -> Views:
        """Return the windows of a tracked worker; search for the worker if most cameras miss it.

        Args:
            source: the present images.
            b: index of the environment.
            worker: index of the worker.
            windows: (C,) windows predicted by the track.
            taken: windows (C,) of other workers.
            has_image: (C,) whether each camera has an image now.
        """
        blind = self.reacquisition.blind_cameras(b, worker, has_image)
        if blind:
            people = self.pose_detector.search(source, blind)
            self.reacquisition.learn(b, worker, people, windows, taken)
        there = self.reacquisition.choose_windows(b, worker, windows)
        return [window if has else None for window, has in zip(there, has_image, strict=True)]

    def _track(self, b: int, worker: int) -> int:
        """Return the number of a worker's track in the detector."""
        return b * self.n_workers + worker

    def _predict_windows(self, expected: PoseEstimate, worker: int) -> Views:
        """Return a worker's windows (C,), which are None without a track or if out of view."""
        if not expected.tracked[worker]:
            return [None] * len(self.cameras)
        px, depth_m = project(self.P, expected.mean_world[worker : worker + 1])
        return list(map(window_from_joints, px[0], depth_m[0], self.cameras))


def _expected_posture(expected: PoseEstimate, worker: int) -> ExpectedPosture:
    """Return the expected posture of a worker; a worker without a track is expected to stand."""
    if not expected.tracked[worker]:
        return ExpectedPosture(False, STANDING)
    joints = expected.mean_world[worker]
    return ExpectedPosture(is_folded(joints), posture_of(joints, expected.velocity_world[worker]))
