"""Images to poses without a simulator: recorded films, live cameras, anybody's renderer.

tracker = PoseTracker(cameras)
while films.advance():
    estimate = tracker.update(films)
"""

from collections.abc import Sequence

import numpy as np

from hrc_env.core.batching import one
from hrc_env.core.records import PoseEstimate
from hrc_env.core.typing import Points3
from hrc_env.geometry.cameras import PinholeCamera, projections
from hrc_env.geometry.shapes import WIDTH
from hrc_env.perception.detector import DetectorConfig
from hrc_env.perception.lensed import pinhole_keypoints
from hrc_env.perception.noise import our_joints
from hrc_env.perception.searching import ImageSource
from hrc_env.pipeline.looking import Looking
from hrc_env.pipeline.tracking import no_keypoints
from hrc_env.scene.rigs import common_views, coverage_of
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.contradiction import find_unexplained
from hrc_env.tracking.estimators import EstimatorChoice, make_estimator
from hrc_env.tracking.people.association import AssociationConfig, associate
from hrc_env.tracking.presence import SEARCHES, Looks, Presence


class PoseTracker:
    """Follows the workers before a rig; what level `pixels` does, for one place. Raises
    `WeightsError` without the network's weights.

    Args:
        cameras: the rig, as of `geometry.cameras.pinhole`.
        n_workers: how many are followed at most.
        dt_s: the usual time between two sets of frames [s].
        estimator: as of an environment.
        tracker, detector: settings; None: the defaults.
        floor_world: (N, 3) points of the floor where people may be, some 0.25 m apart [m]; absence
            is claimed once cameras see all of it empty. None: the views of several cameras.
    """

    def __init__(
        self,
        cameras: Sequence[PinholeCamera],
        n_workers: int = 1,
        dt_s: float = 0.04,
        estimator: EstimatorChoice = "particle",
        tracker: TrackerConfig | None = None,
        detector: DetectorConfig | None = None,
        floor_world: Points3 | None = None,
    ) -> None:
        self.cameras, self.n_workers, self.dt_s = tuple(cameras), n_workers, dt_s
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

    def update(
        self,
        source: ImageSource,
        dt_s: float | None = None,
        rngs: Sequence[np.random.Generator] = (),
    ) -> PoseEstimate:
        """Take the present frames in; workers (1, W, J, ...) in the frame of the cameras' poses.

        Args:
            source: the images of all cameras.
            dt_s: time since the last frames [s]; None: the usual.
            rngs: one generator, for estimators that draw; none: one with seed 0.
        """
        drawn = list(rngs) or [np.random.default_rng(0)]
        dt_s = self.dt_s if dt_s is None else dt_s
        self.estimator.predict(self.state, dt_s, drawn)
        expected = self.estimator.estimate(self.state)
        seen = no_keypoints(1, len(self.cameras), self.n_workers)
        has_image = [True] * len(self.cameras)
        self.looking.look(source, one(expected, 0), 0, has_image, one(seen, 0))
        found = keypoints = pinhole_keypoints(seen, self.cameras)
        if self.n_workers > 1:
            keypoints = associate(self.P, found, expected, AssociationConfig()).keypoints
        self.estimator.update(self.state, keypoints, drawn)
        now, searched = self.estimator.estimate(self.state), self.looking.looked(np.arange(1))
        fresh_s = np.zeros(searched.shape)
        shown = find_unexplained(keypoints, fresh_s, now, self.P, self.focal_px)
        shown.unexplained[:] |= searched & self.looking.unexplained
        looks = Looks(searched, fresh_s, SEARCHES, shown)
        ours, config = our_joints(now), self.estimator.config
        return self.presence.update(np.arange(1), ours, found, keypoints, looks, dt_s, config)

    def forget(self) -> None:
        """Nobody is known any more."""
        self.estimator.reset(self.state, np.arange(1), [np.random.default_rng(0)])
        self.presence.forget(np.arange(1))
        self.looking.forget(0)

    def close(self) -> None:
        """Stop the detector's thread."""
        self.looking.detector.close()
