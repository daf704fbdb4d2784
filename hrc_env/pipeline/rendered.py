"""Level `pixels`: rendered crops through the pose network."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.batching import copied, one, rows
from hrc_env.core.records import Keypoints, PoseEstimate, Roi
from hrc_env.core.typing import Floats, Image, Ints
from hrc_env.geometry.cameras import project
from hrc_env.perception.eyes import Eyes, Sight
from hrc_env.perception.faults.camera_film import CameraFilm, Shot
from hrc_env.perception.faults.recent import Recent
from hrc_env.perception.faults.schedule import Schedule
from hrc_env.perception.lensed import Lensed
from hrc_env.perception.noise import STANDING
from hrc_env.perception.outline import posture_of
from hrc_env.perception.posture import is_folded
from hrc_env.perception.windows import steady_window, window_from_joints
from hrc_env.pipeline.reacquisition import Strays
from hrc_env.pipeline.search_schedule import Searches
from hrc_env.pipeline.sensor_input import Generators, Moment, Windows
from hrc_env.pipeline.tracking import TrackingSenses, no_keypoints
from hrc_env.scene.build import Scene
from hrc_env.scene.domain_randomization import AS_BUILT, Look, draw_look
from hrc_env.scene.render import CropRenderer
from hrc_env.tracking.estimators import Estimator


class CameraSenses(TrackingSenses):
    """Level `pixels`: rendered crops through the pose network."""

    CHANGES = (*TrackingSenses.CHANGES, "windows", "eyes", "worn", "searches", "strays")

    def __init__(
        self, scene: Scene, batch: int, tracker: Estimator, config: HRCConfig, schedule: Schedule
    ) -> None:
        super().__init__(batch, scene, tracker, config, schedule)
        self.renderer = CropRenderer(scene)
        self.lensed = Lensed(self.renderer, scene.cameras)
        film = None if schedule.is_plain else CameraFilm(self.renderer, self.lensed, schedule)
        self.images = film or self.lensed
        self.appearance = config.appearance
        self.worn: list[Look | None] = [None] * batch
        """How each environment looks in its episode; None: as it was built."""
        self.eyes = Eyes(scene.cameras, config.eyes)
        self.windows: list[Windows] = [
            [[None] * len(scene.cameras) for _ in range(scene.n_workers)] for _ in range(batch)
        ]

        self.seen: dict[int, tuple[list[Roi | None], list[Image | None]]] = {}
        """What the network was given of each environment's first worker, and through which windows:
        for pictures, no part of the state."""
        self.searches = Searches(batch, len(scene.cameras), config.eyes.search_every)
        self.strays = Strays(batch, scene.n_workers, len(scene.cameras))

    def detect(self, now: Moment, predicted: Any, sensor_rngs: Generators) -> Keypoints:
        """Landmarks of crops round the predicted worker, or of a search where there is none."""
        seen = no_keypoints(len(now.ids), len(self.scene.cameras), self.scene.n_workers)
        time_s = None if self.recent is None else np.empty(seen.px.shape[:2])
        expected = self.tracker.estimate(predicted)
        for row, b in enumerate(now.ids.tolist()):
            self.renderer.dress(self.worn[b])
            if self.recent is None or time_s is None:
                self.renderer.draw(now.q[row], one(now.motion, row))
                has_image = [True] * len(self.scene.cameras)
            else:
                time_s[row] = self._take_images(now, row, b, self.recent)
                has_image = np.isfinite(time_s[row]).tolist()
            for worker, sight in self._look(expected, row, b, has_image):
                for c in np.flatnonzero(has_image).tolist():
                    self.windows[b][worker][c] = sight.windows[c]
                if worker == 0:
                    self.seen[b] = list(sight.windows), sight.crops
                seen.px[row, :, worker] = sight.px
                seen.confidence[row, :, worker] = sight.confidence
                seen.sigma_px[row, :, worker] = sight.sigma_px
        return replace(seen, time_s=time_s)

    def _take_images(self, now: Moment, row: int, b: int, recent: Recent) -> Floats:
        """Let every camera show what has come of it. (C,) its time; NaN for nothing."""
        step, pose = recent.begin(b), (now.q[row].copy(), copied(one(now.motion, row)))
        before = recent.at(b, step - 1)
        actual = recent.schedule.actual(self.scene.cameras, recent.seeds[b], step)
        last = pose if before is None else (before.q, before.motion)
        recent.keep(b, Shot(step, *pose, last, actual))
        frames = recent.frames(b)
        shots = [None if frame is None else recent.at(b, frame.shows) for frame in frames]
        if isinstance(self.images, CameraFilm):
            self.images.show(shots, recent.seeds[b])
        return recent.times_s(frames)

    def _look(
        self, expected: PoseEstimate, row: int, b: int, has_image: list[bool]
    ) -> Iterator[tuple[int, Sight]]:
        """Look for every worker of an environment; a search finds nobody who has been looked at.

        Those with a window come first, and one search serves all the others. Who is in view of
        cameras only that have no image now is not looked for.
        """
        wanted = [self._windows(expected, row, w) for w in range(self.scene.n_workers)]
        taken: Windows = []
        people, missed = None, False
        self.searches.tick(b)
        for worker in sorted(range(len(wanted)), key=lambda w: not any(wanted[w])):
            steady = list(map(steady_window, self.windows[b][worker], wanted[worker]))
            windows = [w if has else None for w, has in zip(steady, has_image, strict=True)]
            if not any(has_image) or (any(steady) and not any(windows)):
                continue
            if not any(windows) and people is None:
                due = self.searches.due(b, has_image)
                if not due:
                    continue
                people = self.searches.remember(b, due, self.eyes.search(self.images, due))
            if any(windows):
                windows = self._followed(b, worker, windows, taken, has_image)
            track = self._track(b, worker)
            folded, posture = _expected_posture(expected, row, worker)
            sight = self.eyes.look(self.images, windows, track, taken, people, folded, posture)
            taken.append(sight.windows)
            self.strays.saw(b, worker, sight.confidence.max(-1) > 0.0)
            missed |= not any(windows) and not sight.confidence.any()
            yield worker, sight
        if missed:
            self.searches.rest(b)

    def _followed(
        self,
        b: int,
        worker: int,
        windows: list[Roi | None],
        taken: Windows,
        has_image: list[bool],
    ) -> list[Roi | None]:
        """Where to look for a worker with a track: elsewhere if most cameras have missed them."""
        blind = self.strays.blind(b, worker, has_image)
        if blind:
            people = self.eyes.search(self.images, blind)
            self.strays.found(b, worker, people, windows, taken, self.scene.cameras)
        there = self.strays.windows(b, worker, windows)
        return [window if has else None for window, has in zip(there, has_image, strict=True)]

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Forget the tracks, and whom the eyes were following."""
        super().reset(ids, sensor_rngs, tracker_rngs)
        for b in ids:
            self.searches.reset(int(b))
            if self.appearance != AS_BUILT:
                self.worn[b] = draw_look(self.appearance, self.scene.n_workers, sensor_rngs[b])
            for worker in range(self.scene.n_workers):
                self.eyes.forget(self._track(b, worker))
                self.strays.reset(int(b), worker)
                self.windows[b][worker] = [None] * len(self.scene.cameras)

    def _track(self, b: int, worker: int) -> int:
        """The number by which the eyes know a worker of an environment."""
        return int(b) * self.scene.n_workers + worker

    def looks(self, b: int) -> tuple[Keypoints | None, Windows]:
        """The keypoints of environment `b` and the windows they were found in."""
        return rows(self.keypoints, np.array([b])), self.windows[b]

    def crops(self, b: int) -> list[Image | None]:
        """What the network was given of the first worker of environment `b`."""
        windows, crops = self.seen.get(b, ([], []))
        current = self.windows[b][0] if self.windows[b] else []
        return crops if windows == current else [None] * len(current)

    def look_of(self, b: int) -> Look | None:
        """How environment b looks in its episode."""
        return self.worn[b]

    def close(self) -> None:
        """Stop the detector's thread and free the graphics context."""
        self.eyes.close()
        self.renderer.close()

    def _windows(self, predicted: PoseEstimate, row: int, worker: int) -> list[Roi | None]:
        """A window a camera; None where the worker is unknown or out of view: search."""
        if not predicted.tracked[row, worker]:
            return [None] * len(self.scene.cameras)
        px, depth_m = project(self.P, predicted.mean_world[row : row + 1, worker])
        return [
            window_from_joints(px[0, c], depth_m[0, c], camera)
            for c, camera in enumerate(self.scene.cameras)
        ]


def _expected_posture(
    expected: PoseEstimate, row: int, worker: int
) -> tuple[bool, Sequence[float]]:
    """Whether a worker is expected to be folded up; how far they count as each posture."""
    if not expected.tracked[row, worker]:
        return False, STANDING
    joints = expected.mean_world[row, worker]
    return is_folded(joints), posture_of(joints, expected.velocity_world[row, worker])
