"""Images to poses without a simulator: recorded films, live cameras, anybody's renderer.

tracker = PoseTracker(cameras)
for images in films:
    estimate = tracker.update(images)
"""

import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from hrc_env.core.batching import one
from hrc_env.core.brought import (
    check_kind,
    check_kinds,
    count_of,
    numbers_of,
    points_of,
    positive,
)
from hrc_env.core.errors import needed, whole
from hrc_env.core.records import PoseEstimate, Roi
from hrc_env.core.typing import Bools, Capsules, Image, Points3
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.geometry.cameras import PinholeCamera, projections
from hrc_env.geometry.shapes import WIDTH
from hrc_env.perception.detector import DetectorConfig
from hrc_env.perception.frames import Frames
from hrc_env.perception.lensed import pinhole_keypoints
from hrc_env.perception.noise import our_joints
from hrc_env.perception.searching import ImageSource, image_crop
from hrc_env.pipeline.looking import Looking
from hrc_env.pipeline.tracking import no_keypoints
from hrc_env.scene.rig import make_cameras
from hrc_env.scene.rigs import common_views, coverage_of
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.contradiction import find_unexplained
from hrc_env.tracking.estimators import EstimatorChoice, make_estimator
from hrc_env.tracking.people.association import AssociationConfig, associate
from hrc_env.tracking.presence import SEARCHES, Looks, Presence

MOST_WORKERS = 16
"""The most people that one tracker follows."""
MOST_SUMS = 1000
"""Number of checksums that are kept: windows move with people."""


class _Watched:
    """An image source, and the cameras whose images repeat bit for bit: they are stuck."""

    def __init__(self) -> None:
        self.source: ImageSource | None = None
        self.sums: dict[tuple[int, Roi], int] = {}
        """Checksums of the crops of each camera and window."""
        self.repeats: dict[int, bool] = {}
        """Of the cameras that gave a crop of a former window again, whether it is the same."""

    def show(self, source: ImageSource) -> None:
        """Begin with the next images."""
        self.source, self.repeats = source, {}
        if len(self.sums) > MOST_SUMS:
            self.sums.clear()

    def crop(self, camera_index: int, window: Roi) -> Image:
        """Return a crop of the source."""
        crop = image_crop(needed(self.source, "The image source"), camera_index, window)
        new, key = zlib.crc32(crop.tobytes()), (camera_index, window)
        if key in self.sums:
            same = self.sums[key] == new
            self.repeats[camera_index] = same and self.repeats.get(camera_index, True)
        self.sums[key] = new
        return crop

    def stuck(self, n_cameras: int) -> Bools:
        """Return (C,) the cameras all of whose crops are the same as before."""
        return np.array([self.repeats.get(c, False) for c in range(n_cameras)])


class PoseTracker:
    """Follow people in images of a rig, without a simulator, as level `pixels` does.

    Args:
        cameras: the rig: `CameraConfig`s, as `read_rig` returns them, of which the place, the image
            and the lens count; or cameras as of `make_cameras`.
        n_workers: how many are followed at most.
        dt_s: the usual time between two sets of frames [s].
        estimator: as of an environment.
        tracker, detector: settings; None: the defaults.
        floor_world: (N, 3) points of the floor where people may be, some 0.25 m apart [m]; absence
            is claimed once cameras see all of it empty. None: the views of several cameras.

    Raises:
        ConfigError: an argument that cannot work.
        WeightsError: the network's weights are missing.
    """

    def __init__(
        self,
        cameras: Sequence[CameraConfig] | Sequence[PinholeCamera],
        n_workers: int = 1,
        dt_s: float = 0.04,
        estimator: EstimatorChoice = "particle",
        tracker: TrackerConfig | None = None,
        detector: DetectorConfig | None = None,
        floor_world: Points3 | None = None,
    ) -> None:
        check_kinds("cameras", cameras, CameraConfig, PinholeCamera)
        check_kind("tracker", tracker, TrackerConfig, None)
        check_kind("detector", detector, DetectorConfig, None)
        n_workers = whole("n_workers", n_workers, 1, MOST_WORKERS)
        dt_s = positive("dt_s", dt_s, "s")
        if floor_world is not None:
            floor_world = points_of("floor_world [m]", floor_world)
        self.n_workers, self.dt_s = n_workers, dt_s
        self.cameras = tuple(
            make_cameras([each])[0] if isinstance(each, CameraConfig) else each for each in cameras
        )
        self.P = projections(self.cameras)
        self.focal_px = np.array([camera.K[0, 0] for camera in self.cameras])
        self.estimator = make_estimator(estimator, self.P, dt_s, tracker)
        settings = detector or DetectorConfig()
        self.looking = Looking(1, self.cameras, n_workers, settings, floor_world)
        if floor_world is None:
            seen = common_views(self.cameras)
        else:
            seen = coverage_of(self.cameras, np.zeros((0, WIDTH)), floor_world)
        self.state = self.estimator.init(1, n_workers)
        self.presence = Presence(1, n_workers, seen)
        self._watched = _Watched()

    def update(
        self,
        source: ImageSource | Sequence[Image],
        dt_s: float | None = None,
        rngs: Sequence[np.random.Generator] = (),
        robot_world: Capsules | None = None,
    ) -> PoseEstimate:
        """Take the present images in and return the belief about the people in them.

        Args:
            source: the images of all cameras, (H, W, 3) RGB of uint8 each, or what gives windows of
                them. Cameras whose images repeat bit for bit are stuck: they prove no absence.
            dt_s: time since the last frames [s]; None: the usual.
            rngs: one generator, for estimators that draw; none: one with seed 0.
            robot_world: the robot's capsules (K, 2, 3) [m]: of more people than `n_workers` those
                nearest to it are followed. None: those who were followed first.

        Returns:
            Workers (1, W, J, ...) in the frame of the cameras' poses.
        """
        if isinstance(rngs, tuple | list) and not rngs:
            rngs = [np.random.default_rng(0)]
        check_kinds("rngs", rngs, np.random.Generator)
        drawn = list(rngs)
        dt_s = self.dt_s if dt_s is None else positive("dt_s", dt_s, "s")
        if robot_world is not None:
            shape = (count_of(robot_world), 2, 3)
            robot_world = numbers_of("robot_world [m]", robot_world, shape, "K capsules, ends, xyz")
        given: Any = source
        shown = given if hasattr(given, "crop") else Frames(self.cameras, given)
        self.estimator.predict(self.state, dt_s, drawn)
        everyone = np.arange(1)
        expected = self.looking.followed(everyone, self.estimator.estimate(self.state))
        seen = no_keypoints(1, len(self.cameras), self.n_workers)
        has_image = [True] * len(self.cameras)
        self._watched.show(shown)
        self.looking.look(self._watched, one(expected, 0), 0, has_image, one(seen, 0), robot_world)
        found = keypoints = pinhole_keypoints(seen, self.cameras)
        if self.n_workers > 1:
            keypoints = associate(self.P, found, expected, AssociationConfig()).keypoints
        self.estimator.update(self.state, keypoints, drawn)
        now, searched = self.estimator.estimate(self.state), self.looking.looked(everyone)
        searched &= ~self._watched.stuck(len(self.cameras))
        fresh_s = np.zeros(searched.shape)
        poses = find_unexplained(keypoints, fresh_s, now, self.P, self.focal_px)
        poses.unexplained[:] |= searched & self.looking.unexplained
        others = self.looking.bystanders.others(everyone, self.dt_s)
        looks = Looks(searched, fresh_s, SEARCHES, poses, others)
        ours, config = our_joints(now), self.estimator.config
        return self.presence.update(everyone, ours, found, keypoints, looks, dt_s, config)

    @property
    def more_people(self) -> bool:
        """Whether cameras detect more people than `n_workers`; all are then `unknown` as well."""
        return bool(self.presence.vacancy(np.arange(1)).others.any[0])

    def forget(self) -> None:
        """Forget everybody, as at the beginning."""
        self.estimator.reset(self.state, np.arange(1), [np.random.default_rng(0)])
        self.presence.forget(np.arange(1))
        self.looking.forget(0)

    def close(self) -> None:
        """Stop the detector's thread."""
        self.looking.detector.close()
