"""Images to poses without a simulator: recorded films, live cameras, anybody's renderer.

tracker = PoseTracker(cameras)
while films.advance():
    estimate = tracker.update(films)
"""

from collections.abc import Sequence

import numpy as np

from hrc_env.core.batching import one
from hrc_env.core.records import PoseEstimate
from hrc_env.geometry.cameras import PinholeCamera, projections
from hrc_env.perception.detector import DetectorConfig
from hrc_env.perception.lensed import pinhole_keypoints
from hrc_env.perception.noise import our_joints
from hrc_env.perception.searching import ImageSource
from hrc_env.pipeline.looking import Looking
from hrc_env.pipeline.tracking import no_keypoints
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import EstimatorChoice, make_estimator
from hrc_env.tracking.people.association import AssociationConfig, associate
from hrc_env.tracking.presence import SEARCHES, forget_presence, make_presence, with_presence


class PoseTracker:
    """Follows the workers before a rig; what level `pixels` does, for one place. Raises
    `WeightsError` without the network's weights.

    Args:
        cameras: the rig, as of `geometry.cameras.pinhole`.
        n_workers: how many are followed at most.
        dt_s: the usual time between two sets of frames [s].
        estimator: as of an environment.
        tracker, detector: settings; None: the defaults.
    """

    def __init__(
        self,
        cameras: Sequence[PinholeCamera],
        n_workers: int = 1,
        dt_s: float = 0.04,
        estimator: EstimatorChoice = "particle",
        tracker: TrackerConfig | None = None,
        detector: DetectorConfig | None = None,
    ) -> None:
        self.cameras, self.n_workers, self.dt_s = tuple(cameras), n_workers, dt_s
        self.P = projections(self.cameras)
        self.estimator = make_estimator(estimator, self.P, dt_s, tracker)
        self.looking = Looking(1, self.cameras, n_workers, detector or DetectorConfig())
        self.state = self.estimator.init(1, n_workers)
        self.presence = make_presence(1, n_workers, len(self.cameras))

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
        searched = self.looking.schedule.ages == 0
        looked = searched, np.zeros(searched.shape), SEARCHES
        return with_presence(
            self.presence, np.arange(1), our_joints(self.estimator.estimate(self.state)),
            (found, keypoints), looked, dt_s, self.estimator.config,
        )  # fmt: skip

    def forget(self) -> None:
        """Nobody is known any more."""
        self.estimator.reset(self.state, np.arange(1), [np.random.default_rng(0)])
        forget_presence(self.presence, np.arange(1))
        self.looking.forget(0)

    def close(self) -> None:
        """Stop the detector's thread."""
        self.looking.detector.close()
