"""Perception setups that studies compare: level, estimator, cameras and latency."""

from collections.abc import Sequence
from dataclasses import dataclass

from hrc_env.core.errors import check_names
from hrc_env.experiments.rigs import (
    ALL,
    OPPOSITE,
    SINGLE,
    TRIPLES,
    WARM_UP_S,
    Turn,
    delay,
    keep_cameras,
)
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.scene.rigs import RIGS
from hrc_env.tracking.estimators import ESTIMATORS

RIGS_OF = {4: (ALL,), 3: TRIPLES, 2: (*OPPOSITE, (0, 1), (2, 3)), 1: SINGLE}
"""Rigs by number of cameras. Successive episodes use them in turn."""


@dataclass(frozen=True, slots=True)
class PerceptionSetup:
    """The perception of a robot in a study: level, estimator, working cameras and latency."""

    level: str = "keypoints"
    """Perception level, as the argument `perception` of an environment."""
    estimator: str = "particle"
    """Name of the estimator, for levels with cameras."""
    n_cameras: int = 4
    """Number of the scene's four cameras that work after the warm-up."""
    latency_s: float = 0.0
    """Delay from exposure to arrival of an image [s]."""
    is_told: bool = True
    """Whether images carry their time stamps; otherwise they appear to be current."""
    is_alone: bool = False
    """Whether cameras that do not work are absent from the start, in which case there is no
    warm-up."""

    @property
    def name(self) -> str:
        """Name of the setup in results.json."""
        if self.level in ("truth", "none"):
            return self.level
        name = f"{self.level}_{self.estimator}_{self.n_cameras}cam_{1000 * self.latency_s:.0f}ms"
        return name + ("" if self.is_told else "_untold") + ("_alone" if self.is_alone else "")

    @property
    def words(self) -> str:
        """Description of the setup in tables and figures."""
        if self.level in ("truth", "none"):
            return self.level
        words = f"{self.estimator}, {self.n_cameras} camera{'s' if self.n_cameras > 1 else ''}"
        if self.level == "pixels":
            words = f"pixels, {words}"
        if self.n_cameras < 4:
            words += " from the start" if self.is_alone else f" after {WARM_UP_S:g} s"
        if self.latency_s:
            words += f", {1000 * self.latency_s:.0f} ms late"
            words += "" if self.is_told else ", not time-stamped"
        return words

    @property
    def is_plain(self) -> bool:
        """Whether all cameras work and no images are delayed."""
        return self.n_cameras == 4 and not self.latency_s

    @property
    def turns(self) -> tuple[Turn, ...]:
        """Cameras and their faults, which successive episodes use in turn."""
        return self.list_turns(RIGS["lab"])

    def list_turns(self, rig: Sequence[CameraConfig]) -> tuple[Turn, ...]:
        """Return the cameras and faults that episodes use in turn, for any rig of four cameras.

        Args:
            rig: the four cameras of the rig.
        """
        turns = (
            Turn(tuple(rig[c] for c in kept)) if self.is_alone else keep_cameras(rig, kept)
            for kept in RIGS_OF[self.n_cameras]
        )
        return tuple(delay(turn, self.latency_s, self.is_told) for turn in turns)


LATE_S = (0.12, 0.2)
"""Delays of images [s], which are three and five control steps."""
LATE = tuple(PerceptionSetup(latency_s=s, is_told=told) for told in (True, False) for s in LATE_S)
"""Setups of four cameras with delayed images, with and without time stamps."""
ON_REQUEST = ("kalman", "ransac", "paper")
"""Names of estimators that are compared only on request. With four cameras, `kalman` equals the
default."""
REFERENCE = PerceptionSetup().name
"""Name of the setup with which all others are compared."""


def list_setups() -> dict[str, PerceptionSetup]:
    """Return the setups by name, including every registered estimator; the slowest is last."""
    setups = (
        PerceptionSetup("truth"),
        PerceptionSetup("none"),
        *(PerceptionSetup(estimator=name) for name in ESTIMATORS),
        *(PerceptionSetup(n_cameras=n) for n in (3, 2, 1)),
        PerceptionSetup(n_cameras=1, is_alone=True),
        *LATE,
        *(PerceptionSetup(n_cameras=1, latency_s=s) for s in LATE_S),
        PerceptionSetup("pixels"),
    )
    return {each.name: each for each in setups}


def list_default_setups() -> tuple[str, ...]:
    """Return the names of the setups that are compared by default."""
    return tuple(name for name, each in list_setups().items() if each.estimator not in ON_REQUEST)


def find_setup(name: str) -> PerceptionSetup:
    """Return a setup by name, or raise `ConfigError` if it does not exist."""
    setups = list_setups()
    check_names("perception setup", [name], setups)
    return setups[name]
