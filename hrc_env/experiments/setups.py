"""The perception setups that are exchanged: level, estimator, cameras, lateness."""

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
    late,
    left_with,
)
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.scene.rigs import RIGS
from hrc_env.tracking.estimators import ESTIMATORS

RIGS_OF = {4: (ALL,), 3: TRIPLES, 2: (*OPPOSITE, (0, 1), (2, 3)), 1: SINGLE}
"""By how many cameras there are; episodes take turns in them."""


@dataclass(frozen=True, slots=True)
class PerceptionSetup:
    """How a robot perceives in a study: level, estimator, cameras that are left, lateness."""

    level: str = "keypoints"
    """As `perception=` of an environment."""
    estimator: str = "particle"
    """Its name, where the level has cameras."""
    n_cameras: int = 4
    """That are left after the warm-up, of the scene's four."""
    latency_s: float = 0.0
    """From taking an image to having it [s]."""
    is_told: bool = True
    """Whether images say when they were taken; if not, they claim to be new."""
    is_alone: bool = False
    """Whether the other cameras were never there."""

    @property
    def name(self) -> str:
        """As in results.json."""
        if self.level in ("truth", "none"):
            return self.level
        name = f"{self.level}_{self.estimator}_{self.n_cameras}cam_{1000 * self.latency_s:.0f}ms"
        return name + ("" if self.is_told else "_untold") + ("_alone" if self.is_alone else "")

    @property
    def words(self) -> str:
        """As in tables and figures."""
        if self.level in ("truth", "none"):
            return self.level
        words = f"{self.estimator}, {self.n_cameras} camera{'s' if self.n_cameras > 1 else ''}"
        if self.level == "pixels":
            words = f"pixels, {words}"
        if self.n_cameras < 4:
            words += " from the start" if self.is_alone else f" after {WARM_UP_S:g} s"
        if self.latency_s:
            words += f", {1000 * self.latency_s:.0f} ms late"
            words += "" if self.is_told else ", delay unknown"
        return words

    @property
    def is_plain(self) -> bool:
        """Whether all cameras are there, on time."""
        return self.n_cameras == 4 and not self.latency_s

    @property
    def turns(self) -> tuple[Turn, ...]:
        """Cameras and their faults, in which episodes take turns."""
        return self.list_turns(RIGS["lab"])

    def list_turns(self, rig: Sequence[CameraConfig]) -> tuple[Turn, ...]:
        """Return cameras and their faults with another rig of four.

        Args:
            rig: its cameras.
        """
        turns = (
            Turn(tuple(rig[c] for c in kept)) if self.is_alone else left_with(rig, kept)
            for kept in RIGS_OF[self.n_cameras]
        )
        return tuple(late(turn, self.latency_s, self.is_told) for turn in turns)


LATE_S = (0.12, 0.2)
"""How late images are [s]: three and five control steps."""
LATE = tuple(PerceptionSetup(latency_s=s, is_told=told) for told in (True, False) for s in LATE_S)
"""Late images of four cameras: those that say how late they are, and those that do not."""
ON_REQUEST = ("kalman", "ransac", "paper")
"""Estimators that are compared on request only; with four cameras `kalman` equals the default."""
REFERENCE = PerceptionSetup().name
"""What everybody is compared with."""


def all_setups() -> dict[str, PerceptionSetup]:
    """By name, with every estimator that is registered now; the slowest last."""
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


def usual_setups() -> tuple[str, ...]:
    """The names of those that are compared if nobody asks for others."""
    return tuple(name for name, each in all_setups().items() if each.estimator not in ON_REQUEST)


def setup_called(name: str) -> PerceptionSetup:
    """A setup by name, or a `ConfigError`."""
    setups = all_setups()
    check_names("perception setup", [name], setups)
    return setups[name]
