"""Tracking of people in images by the pose network, which is applied to crops around them."""

from dataclasses import replace

import numpy as np

from hrc_env.core.batching import one
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Bools, Capsules, Floats, Image, Ints
from hrc_env.core.vacancy import Others
from hrc_env.perception.searching import ImageSource
from hrc_env.pipeline.sensor_input import Generators, Sensor
from hrc_env.pipeline.tracking import Detections, PoseTracking, TrackingSetup, no_keypoints
from hrc_env.pipeline.worker_detector import WorkerDetector
from hrc_env.tracking.estimators import Estimator
from hrc_env.tracking.presence import SEARCHES


class ImageSensor(Sensor):
    """A sensor that consists of cameras with images."""

    images: ImageSource
    """Present images of the environment that was selected by the last call of `show`."""
    has_times = True
    """Whether images may be delayed and have timestamps."""

    def show(self, b: int) -> Floats:
        """Set `images` to the present images of environment b.

        Returns:
            (C,) time at which each camera's image was taken, by the clock of `Keypoints.time_s`
            [s]; NaN for cameras without an image.
        """
        raise NotImplementedError

    def stuck_cameras(self, ids: Ints) -> Bools:
        """Return a mask (B, C) of the cameras that repeat their images.

        Repeated images do not prove the absence of people. The base class returns False, (B, 1).
        """
        return np.zeros((len(ids), 1), np.bool_)

    def robots_world(self) -> Capsules | None:
        """Return the robots' capsules (B, K, 2, 3) [m], or None if they are unknown."""
        return None


class ImageTracking(PoseTracking):
    """A pipeline that tracks people in images.

    Args:
        batch: number of environments.
        setup: cameras, people and settings.
        tracker: the estimator.
        sensor: the cameras.
        detector: the detector of workers in their images.
    """

    CHANGES = (*PoseTracking.CHANGES, "worker_detector")
    N_IMAGES = SEARCHES

    def __init__(
        self,
        batch: int,
        setup: TrackingSetup,
        tracker: Estimator,
        sensor: ImageSensor,
        detector: WorkerDetector,
    ) -> None:
        super().__init__(batch, setup, tracker, sensor)
        self.image_sensor, self.worker_detector = sensor, detector

    def detect(
        self, ids: Ints, expected: PoseEstimate, due: Bools, sensor_rngs: Generators
    ) -> Keypoints:
        """Return keypoints from crops around the predicted workers, or from a search."""
        sensor = self.image_sensor
        seen = no_keypoints(len(ids), len(self.setup.cameras), self.setup.n_workers)
        time_s, robots_world = np.zeros(seen.px.shape[:2]), sensor.robots_world()
        for row, b in enumerate(ids.tolist()):
            time_s[row] = np.where(due[row], sensor.show(b), np.nan)
            if not due[row].any():
                continue
            has_image = np.isfinite(time_s[row]).tolist()
            predicted = one(expected, row)
            robot_world = None if robots_world is None else robots_world[row]
            out = one(seen, row)
            self.worker_detector.detect(sensor.images, predicted, b, has_image, out, robot_world)
        return replace(seen, time_s=time_s if sensor.has_times or not due.all() else None)

    def searched_cameras(self, ids: Ints, age_s: Floats) -> Bools:
        """Return a mask (B, C) of the cameras with a whole image that was searched for people."""
        return self.worker_detector.searched_cameras(ids) & ~self.image_sensor.stuck_cameras(ids)

    def cameras_with_others(self, ids: Ints) -> Bools:
        """Return a mask (B, C) of cameras that found people besides workers in the last search."""
        return self.worker_detector.unexplained[ids]

    def drop_given_up(self, ids: Ints, expected: PoseEstimate) -> PoseEstimate:
        """Return a prediction without tracks in slots that are reassigned to nearer people."""
        return self.worker_detector.drop_given_up(ids, expected)

    def others(self, ids: Ints) -> Others:
        """Return the people that are not assigned to a slot."""
        return self.worker_detector.bystanders.others(ids, self.setup.dt_s)

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Delete the tracks and the images of environments `ids`."""
        super().reset(ids, sensor_rngs, tracker_rngs)
        for b in ids:
            self.worker_detector.forget(int(b))

    def last_detections(self, b: int) -> Detections:
        """Return the last keypoints of environment `b`, and the windows of their detection."""
        return Detections(super().last_detections(b).keypoints, self.worker_detector.windows[b])

    def crops(self, b: int) -> list[Image | None]:
        """Return the last crop (C,) of environment `b`'s first worker in each camera."""
        return self.worker_detector.crops(b)

    def close(self) -> None:
        """Stop the detector's threads."""
        self.worker_detector.close()
