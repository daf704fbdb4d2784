"""The pairs of eyes that are exchanged: perception level, estimator, cameras, lateness."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from hrc_env.core.errors import unknown
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.scene.rigs import RIGS
from hrc_env.tracking.estimators import ESTIMATORS

Rig = tuple[int, ...]
"""Cameras of the laboratory, counted from 0."""
ALL: Rig = (0, 1, 2, 3)
RIGS_OF: Mapping[int, tuple[Rig, ...]] = {
    4: (ALL,),
    3: ((0, 1, 2), (1, 2, 3), (2, 3, 0), (3, 0, 1)),
    2: ((0, 2), (1, 3), (0, 1), (2, 3)),
    1: ((0,), (1,), (2,), (3,)),
}
"""So that no number hangs on one place in the room, episodes take turns: every camera alone,
two diagonals and two neighbours, every three."""
LEFT_FROM_S = 1.0
"""Where fewer than four cameras are asked about, the others fail then [s]: a worker is acquired
by two cameras that agree, so that a rig of one would never follow anybody."""
CTRL_DT_S = 0.04
"""Lateness is counted in control steps of this length [s]."""


@dataclass(frozen=True, slots=True)
class Eyes:
    """How a robot sees."""

    name: str
    """As in results.json."""
    perception: str
    estimator: str = "particle"
    n_cameras: int = 4
    """That are left after `LEFT_FROM_S`."""
    latency_s: float = 0.0
    """From taking an image to having it [s]."""
    is_told: bool = True
    """Whether images say when they were taken; if not, they claim to be new."""
    is_alone: bool = False
    """Whether the other cameras were never there."""

    @property
    def rigs(self) -> tuple[Rig, ...]:
        """The rigs that episodes take turns in."""
        return RIGS_OF[self.n_cameras]

    def cameras(self, rig: Rig) -> tuple[CameraConfig, ...]:
        """Cameras that hang in the room, as late as these eyes are."""
        late_s = self.latency_s if self.is_told else 0.0
        return tuple(replace(RIGS["lab"][k], latency_s=late_s) for k in self._hung(rig))

    def faults(self, rig: Rig) -> list[FaultConfig]:
        """Cameras that fail, and images that are late and claim to be new."""
        lost = tuple(RIGS["lab"][k].name for k in self._hung(rig) if k not in rig)
        found = [FaultConfig("lost", lost, from_s=LEFT_FROM_S)] if lost else []
        if self.latency_s > 0 and not self.is_told:
            n_steps = round(self.latency_s / CTRL_DT_S)
            found.append(FaultConfig("out_of_step", ("all",), float(n_steps)))
        return found

    def _hung(self, rig: Rig) -> Rig:
        return rig if self.is_alone else ALL


def seeing(
    estimator: str = "particle",
    n_cameras: int = 4,
    latency_s: float = 0.0,
    is_told: bool = True,
    is_alone: bool = False,
    perception: str = "keypoints",
) -> Eyes:
    """Eyes with cameras; their name says what they are."""
    name = f"{perception}_{estimator}_{n_cameras}cam_{round(1000 * latency_s)}ms"
    name += "" if is_told else "_untold"
    name += "_alone" if is_alone else ""
    return Eyes(name, perception, estimator, n_cameras, latency_s, is_told, is_alone)


LATE_S = (0.12, 0.2)
"""How late images are [s]: three and five control steps."""
LATE = tuple(seeing(latency_s=s, is_told=told) for told in (True, False) for s in LATE_S)
"""Late eyes with four cameras: those that are told how late they are, and those that are not."""
NOT_ASKED = ("ransac",)
"""Estimators that are compared on request only."""
REFERENCE = seeing().name
"""What everybody is compared with."""
PIXELS = seeing(perception="pixels").name


def all_eyes() -> dict[str, Eyes]:
    """By name, with every estimator that is registered now; the slowest last."""
    eyes = (
        Eyes("truth", "truth"),
        Eyes("none", "none"),
        *(seeing(estimator) for estimator in ESTIMATORS),
        *(seeing(n_cameras=n) for n in (3, 2, 1)),
        seeing(n_cameras=1, is_alone=True),
        *LATE,
        *(seeing(n_cameras=1, latency_s=s) for s in LATE_S),
        seeing(perception="pixels"),
    )
    return {each.name: each for each in eyes}


def usual_eyes() -> tuple[str, ...]:
    """The names of those that are compared if nobody asks for others."""
    left_out = {seeing(name).name for name in NOT_ASKED}
    return tuple(name for name in all_eyes() if name not in left_out)


def eyes_called(name: str) -> Eyes:
    """Eyes by name.

    Raises:
        ConfigError: there are none of that name.
    """
    eyes = all_eyes()
    if name not in eyes:
        raise unknown("eyes", name, eyes)
    return eyes[name]
