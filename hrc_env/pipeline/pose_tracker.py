"""Pose tracking in images from any source: recorded videos, live cameras or other renderers.

tracker = PoseTracker(cameras)
for images in videos:
    estimate = tracker.update(images)
"""

import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from hrc_env.core.brought import (
    check_kind,
    check_kinds,
    count_of,
    numbers_of,
    points_of,
    positive,
)
from hrc_env.core.errors import check_integer, require
from hrc_env.core.records import PoseEstimate, Roi
from hrc_env.core.typing import Bools, Capsules, Floats, Image, Ints, Points3
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.geometry.cameras import PinholeCamera, projections
from hrc_env.geometry.shapes import WIDTH
from hrc_env.perception.detector import DetectorConfig
from hrc_env.perception.frames import Frames
from hrc_env.perception.searching import ImageSource, crop_image
from hrc_env.pipeline.image_tracking import ImageSensor, ImageTracking
from hrc_env.pipeline.tracking import TrackingSetup
from hrc_env.pipeline.worker_detector import WorkerDetector
from hrc_env.scene.rig import make_cameras
from hrc_env.scene.rigs import common_views, coverage_of
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import EstimatorChoice, make_estimator

MOST_WORKERS = 16
"""Maximum number of people that one tracker can track."""
MOST_SUMS = 1000
"""Maximum number of stored checksums of crops. Because windows move with people, checksums
accumulate; if there are more, all are deleted."""
_ALONE = np.arange(1)
"""Indices of the environments in a batch of one."""


class _Films(ImageSensor):
    """A sensor with images passed by the caller, which detects cameras that repeat their images.

    Args:
        n_cameras: number C of cameras.
    """

    CHANGES = ("sums", "repeats")
    has_times = False

    def __init__(self, n_cameras: int) -> None:
        self.n_cameras = n_cameras
        self.images = self
        self.source: ImageSource | None = None
        self.robot_world: Capsules | None = None
        """(K, 2, 3) the robot's capsules [m]; None if they are unknown."""
        self.sums: dict[tuple[int, Roi], int] = {}
        """Checksum of the last crop of each camera and window."""
        self.repeats: dict[int, bool] = {}
        """Whether all crops from previously used windows are unchanged, by camera."""

    def take(self, source: ImageSource, robot_world: Capsules | None) -> None:
        """Set the present images and the robot's capsules."""
        self.source, self.robot_world, self.repeats = source, robot_world, {}
        if len(self.sums) > MOST_SUMS:
            self.sums.clear()

    def show(self, b: int) -> Floats:
        """Return the timestamps (C,) of the images [s]: zero, because all images are current."""
        return np.zeros(self.n_cameras)

    def crop(self, camera_index: int, window: Roi) -> Image:
        """Return a window (256, 256, 3) of a camera's image, and record whether it has changed."""
        crop = crop_image(require(self.source, "The image source"), camera_index, window)
        new, key = zlib.crc32(crop.tobytes()), (camera_index, window)
        if key in self.sums:
            same = self.sums[key] == new
            self.repeats[camera_index] = same and self.repeats.get(camera_index, True)
        self.sums[key] = new
        return crop

    def stuck_cameras(self, ids: Ints) -> Bools:
        """Return a mask (1, C) of the cameras for which all crops are unchanged."""
        return np.array([[self.repeats.get(c, False) for c in range(self.n_cameras)]])

    def robots_world(self) -> Capsules | None:
        """Return the robot's capsules (1, K, 2, 3) [m], or None if they are unknown."""
        return None if self.robot_world is None else self.robot_world[None]


class PoseTracker:
    """A tracker of people in the images of a rig, with the methods of perception level `pixels`.

    It does not need a simulator.

    Args:
        cameras: the rig: either `CameraConfig`s, such as those from `read_rig`, of which only pose,
            image size, intrinsics and lens are used; or the result of `make_cameras`.
        n_workers: maximum number of tracked people.
        dt_s: default time between two sets of frames [s].
        estimator: the estimator, as in `EnvConfig`.
        tracker: settings of the tracker; None for the defaults.
        detector: settings of the detector; None for the defaults.
        floor_world: (N, 3) points of the floor where people may be, about 0.25 m apart [m]. People
            are considered absent once the cameras have observed all of these points to be empty.
            None for the floor in the common view of the cameras.

    Raises:
        ConfigError: an argument is invalid.
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
        n_workers = check_integer("n_workers", n_workers, 1, MOST_WORKERS)
        dt_s = positive("dt_s", dt_s, "s")
        if floor_world is not None:
            floor_world = points_of("floor_world [m]", floor_world)
        rig = tuple(
            make_cameras([each])[0] if isinstance(each, CameraConfig) else each for each in cameras
        )
        if floor_world is None:
            seen = common_views(rig)
        else:
            seen = coverage_of(rig, np.zeros((0, WIDTH)), floor_world)
        settings = detector or DetectorConfig()
        self._films = _Films(len(rig))
        self._tracking = ImageTracking(
            1,
            TrackingSetup(rig, n_workers, seen, dt_s, every=settings.every,
                          in_turns=settings.in_turns),
            make_estimator(estimator, projections(rig), dt_s, tracker),
            self._films,
            WorkerDetector(1, rig, n_workers, settings, floor_world),
        )  # fmt: skip

    def update(
        self,
        source: ImageSource | Sequence[Image],
        dt_s: float | None = None,
        rngs: Sequence[np.random.Generator] = (),
        robot_world: Capsules | None = None,
    ) -> PoseEstimate:
        """Update the tracks with the present images, and return the belief about the people.

        Args:
            source: (C,) images of the cameras, (H, W, 3) RGB of uint8 each, or an `ImageSource`
                that returns windows of them. A camera is considered stuck if its images repeat bit
                for bit; it then does not prove that people are absent.
            dt_s: time since the last frames [s]; None for the default time.
            rngs: one random generator, for stochastic estimators; if empty, one with seed 0.
            robot_world: (K, 2, 3) capsules of the robot [m]. If there are more people than
                `n_workers`, those nearest to the robot are tracked. If it is None, people that are
                already tracked have priority.

        Returns:
            Belief about the workers (1, W, J, ...), in the frame of the cameras' poses.
        """
        if isinstance(rngs, tuple | list) and not rngs:
            rngs = [np.random.default_rng(0)]
        check_kinds("rngs", rngs, np.random.Generator)
        setup, drawn = self._tracking.setup, list(rngs)
        dt_s = setup.dt_s if dt_s is None else positive("dt_s", dt_s, "s")
        if robot_world is not None:
            shape = (count_of(robot_world), 2, 3)
            robot_world = numbers_of("robot_world [m]", robot_world, shape, "K capsules, ends, xyz")
        given: Any = source
        shown = given if hasattr(given, "crop") else Frames(setup.cameras, given)
        self._films.take(shown, robot_world)
        return self._tracking.track(_ALONE, dt_s, drawn, drawn)

    @property
    def more_people(self) -> bool:
        """Whether cameras detect more people than `n_workers`; if so, all slots are `unknown`."""
        return bool(self._tracking.vacancy(_ALONE).others.any[0])

    def forget(self) -> None:
        """Delete all tracks, and return to the initial state."""
        rngs = [np.random.default_rng(0)]
        self._tracking.reset(_ALONE, rngs, rngs)

    def close(self) -> None:
        """Stop the detector's threads."""
        self._tracking.close()
