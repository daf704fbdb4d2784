"""Follow people in images, whoever takes them: crops around them through the pose network."""

from dataclasses import replace

import numpy as np

from hrc_env.core.batching import one
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Bools, Capsules, Floats, Image, Ints
from hrc_env.core.vacancy import Others
from hrc_env.perception.searching import ImageSource
from hrc_env.pipeline.looking import Looking
from hrc_env.pipeline.sensor_input import Generators, Sensor, Windows
from hrc_env.pipeline.tracking import PoseTracking, TrackingSetup, no_keypoints
from hrc_env.tracking.estimators import Estimator
from hrc_env.tracking.presence import SEARCHES


class ImageSensor(Sensor):
    """Cameras that give images."""

    images: ImageSource
    """The present images of the environment that `show` was last asked for."""
    tells_times = True
    """Whether images may be old, and carry the time at which they were taken."""

    def show(self, b: int) -> Floats:
        """Make the images of environment b present, and return when each camera's was taken (C,)
        [s], by the clock of `Keypoints.time_s`; NaN: there is none."""
        raise NotImplementedError

    def stuck(self, ids: Ints) -> Bools:
        """Return (B, C) the cameras whose images prove no absence, as they repeat; (B, 1): none."""
        return np.zeros((len(ids), 1), np.bool_)

    def robots_world(self) -> Capsules | None:
        """Return (B, K, 2, 3) the robots' capsules [m]; None: unknown."""
        return None


class ImageTracking(PoseTracking):
    """Follows people in a sensor's images."""

    CHANGES = (*PoseTracking.CHANGES, "looking")
    LOOKS = SEARCHES

    def __init__(
        self,
        batch: int,
        setup: TrackingSetup,
        tracker: Estimator,
        sensor: ImageSensor,
        looking: Looking,
    ) -> None:
        super().__init__(batch, setup, tracker, sensor)
        self.image_sensor, self.looking = sensor, looking

    def detect(self, ids: Ints, expected: PoseEstimate, sensor_rngs: Generators) -> Keypoints:
        """Landmarks of crops round the expected workers, or of a search where there are none."""
        sensor = self.image_sensor
        seen = no_keypoints(len(ids), len(self.setup.cameras), self.setup.n_workers)
        time_s, robots_world = np.zeros(seen.px.shape[:2]), sensor.robots_world()
        for row, b in enumerate(ids.tolist()):
            time_s[row] = sensor.show(b)
            has_image = np.isfinite(time_s[row]).tolist()
            known, robot_world = one(expected, row), None
            if robots_world is not None:
                robot_world = robots_world[row]
            self.looking.look(sensor.images, known, b, has_image, one(seen, row), robot_world)
        return replace(seen, time_s=time_s if sensor.tells_times else None)

    def looked(self, ids: Ints, age_s: Floats) -> Bools:
        """(B, C) which cameras' whole images have been searched."""
        return self.looking.looked(ids) & ~self.image_sensor.stuck(ids)

    def strangers(self, ids: Ints) -> Bools:
        """Return (B, C) the cameras whose last search found people beside the workers."""
        return self.looking.unexplained[ids]

    def followed(self, ids: Ints, expected: PoseEstimate) -> PoseEstimate:
        """Return the expected poses of the workers who are followed."""
        return self.looking.followed(ids, expected)

    def others(self, ids: Ints) -> Others:
        """Return the people beyond the slots."""
        return self.looking.bystanders.others(ids, self.setup.dt_s)

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Forget the tracks, and who was followed."""
        super().reset(ids, sensor_rngs, tracker_rngs)
        for b in ids:
            self.looking.forget(int(b))

    def last_detections(self, b: int) -> tuple[Keypoints | None, Windows]:
        """The keypoints of environment `b` and the windows they were found in."""
        return super().last_detections(b)[0], self.looking.windows[b]

    def crops(self, b: int) -> list[Image | None]:
        """Return the crops of the first worker of environment `b` that the network was given."""
        return self.looking.crops(b)

    def close(self) -> None:
        """Stop the detector's thread."""
        self.looking.detector.close()
