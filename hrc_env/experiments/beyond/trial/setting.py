"""One setting of a study: who walks where, before which cameras, followed by what."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from hrc_env.core.errors import ConfigError, unknown
from hrc_env.experiments.beyond.trial.handicaps import BONES, MOTION, TREES
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.scene.rigs import RIGS
from hrc_env.tracking.config import TrackerConfig

WARM_UP_S = 1.0
"""The first second is not judged; cameras that a setting takes away are there until then, since
no estimator begins a track with one [s]."""
Rig = tuple[int, ...]
"""Cameras of a rig, counted from 0."""


@dataclass(frozen=True, slots=True)
class Turn:
    """Cameras and what goes wrong with them, for some of a setting's episodes."""

    cameras: tuple[CameraConfig, ...] = ()
    """All that hang there; none: the scene's own."""
    faults: tuple[FaultConfig, ...] = ()


@dataclass(frozen=True, slots=True)
class Setting:
    """What is the same in all episodes of a row."""

    name: str
    """As in results.json."""
    words: str
    """As in tables and figures."""
    scene: str = "lab"
    n_workers: int = 1
    estimator: str = "particle"
    tracker: TrackerConfig = field(default_factory=TrackerConfig)
    bones: str = "learnt"
    """One of `handicaps.BONES`."""
    motion: str = "model"
    """One of `handicaps.MOTION`."""
    turns: tuple[Turn, ...] = (Turn(),)
    """Episodes take turns in them, so that nothing hangs on one camera's place."""
    by_sight: bool = False
    """Whether errors are also kept by how many cameras see the joint."""
    is_timed: bool = False
    """Whether updates are timed."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for what cannot be played."""
        for name, valid in (("bones", BONES), ("motion", MOTION)):
            given = getattr(self, name)
            if given not in valid:
                raise unknown(name, given, valid)
            if given != valid[0] and self.estimator not in TREES:
                raise ConfigError(
                    f"Setting {self.name!r}: {name}={given!r} is for {' and '.join(TREES)}, which "
                    f"have a body on a tree; got {self.estimator!r}."
                )

    def numbers(self) -> dict[str, Any]:
        """What its episodes depend on."""
        values = asdict(self)
        del values["words"]
        return values


def left_with(rig: Sequence[CameraConfig], kept: Rig) -> Turn:
    """A rig of which these cameras are left when the warm-up is over."""
    gone = tuple(camera.name for c, camera in enumerate(rig) if c not in kept)
    lost = (FaultConfig("lost", gone, from_s=WARM_UP_S),) if gone else ()
    return Turn(tuple(rig), lost)


ALL: Rig = (0, 1, 2, 3)
SINGLE: tuple[Rig, ...] = ((0,), (1,), (2,), (3,))
NEIGHBOURS: tuple[Rig, ...] = ((0, 1), (1, 2), (2, 3), (3, 0))
OPPOSITE: tuple[Rig, ...] = ((0, 2), (1, 3))
TRIPLES: tuple[Rig, ...] = ((0, 1, 2), (1, 2, 3), (2, 3, 0), (3, 0, 1))
"""Choices of the four cameras that hang in a scene's corners, by how many they are."""
PAIRS: tuple[Rig, ...] = (NEIGHBOURS[0], OPPOSITE[0], NEIGHBOURS[1], OPPOSITE[1])
"""Two diagonals and two neighbours, so that no number hangs on how two hang."""


def left_of(scene: str, rigs: Sequence[Rig]) -> tuple[Turn, ...]:
    """Turns in which a scene's own four cameras are left in these choices."""
    return tuple(left_with(RIGS[scene], rig) for rig in rigs)
