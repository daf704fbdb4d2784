"""Which cameras hang in episodes: settings take turns in rigs, so that no number hangs on a place.

Fewer than four are what is left of four after a while, so that every estimator begins a track.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from hrc_env.config import HRCConfig
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.scene.rigs import RIGS

WARM_UP_S, DT_S = 1.0, HRCConfig().ctrl_dt
"""Until when cameras that a setting takes away are there, and a control step [s]."""
N_WARM_UP = round(WARM_UP_S / DT_S)
Rig = tuple[int, ...]
"""Cameras of a scene, counted from 0."""
ALL: Rig = (0, 1, 2, 3)
SINGLE: tuple[Rig, ...] = ((0,), (1,), (2,), (3,))
NEIGHBOURS: tuple[Rig, ...] = ((0, 1), (1, 2), (2, 3), (3, 0))
OPPOSITE: tuple[Rig, ...] = ((0, 2), (1, 3))
TRIPLES: tuple[Rig, ...] = ((0, 1, 2), (1, 2, 3), (2, 3, 0), (3, 0, 1))
MULTI = "multi"
"""All four cameras, in the names of numbers."""
SPOKEN = {f"camera_{k}": f"camera {k}" for k in range(1, 5)} | {MULTI: "all four"}
"""Each camera alone and all together, in words."""
CHOICES: dict[str, Rig] = dict(zip(SPOKEN, (*SINGLE, ALL), strict=True))
"""The same, as rigs."""


@dataclass(frozen=True, slots=True)
class Turn:
    """Cameras and what goes wrong with them, for some of a setting's episodes."""

    cameras: tuple[CameraConfig, ...] = ()
    """All that hang there; none: the scene's own."""
    faults: tuple[FaultConfig, ...] = ()


def left_with(rig: Sequence[CameraConfig], kept: Rig) -> Turn:
    """A rig of which these cameras are left when the warm-up is over."""
    lost = tuple(camera.name for c, camera in enumerate(rig) if c not in kept)
    return Turn(tuple(rig), (FaultConfig("lost", lost, from_s=WARM_UP_S),) if lost else ())


def left_of(scene: str, rigs: Sequence[Rig]) -> tuple[Turn, ...]:
    """Turns in which a scene's own four cameras are left in these choices."""
    return tuple(left_with(RIGS[scene], rig) for rig in rigs)


def late(turn: Turn, latency_s: float, is_told: bool) -> Turn:
    """A turn whose images are late: they say when they were taken, or claim to be new."""
    if latency_s and is_told:
        cameras = tuple(replace(camera, latency_s=latency_s) for camera in turn.cameras)
        return Turn(cameras, turn.faults)
    n_steps = round(latency_s / DT_S)
    wrong = (FaultConfig("out_of_step", ("all",), float(n_steps)),) if n_steps else ()
    return Turn(turn.cameras, (*turn.faults, *wrong))
