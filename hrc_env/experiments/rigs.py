"""Choices of cameras, which successive episodes use in turn.

Results therefore do not depend on the position of one camera. In settings with fewer than four
cameras, the others fail only after a warm-up, in which every estimator can begin a track.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from hrc_env.config import HRCConfig
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.scene.rigs import RIGS

WARM_UP_S, DT_S = 1.0, HRCConfig().ctrl_dt
"""Durations of the warm-up, in which all cameras work, and of a control step [s]."""
N_WARM_UP = round(WARM_UP_S / DT_S)
"""Number of control steps in the warm-up."""
Rig = tuple[int, ...]
"""Indices of the cameras that belong to a rig, counted from 0 in their scene."""
ALL: Rig = (0, 1, 2, 3)
SINGLE: tuple[Rig, ...] = ((0,), (1,), (2,), (3,))
NEIGHBOURS: tuple[Rig, ...] = ((0, 1), (1, 2), (2, 3), (3, 0))
OPPOSITE: tuple[Rig, ...] = ((0, 2), (1, 3))
TRIPLES: tuple[Rig, ...] = ((0, 1, 2), (1, 2, 3), (2, 3, 0), (3, 0, 1))
MULTI = "multi"
"""Name of the rig of all four cameras in names of metrics."""
CAMERA_LABELS = {f"camera_{k}": f"camera {k}" for k in range(1, 5)} | {MULTI: "all four"}
"""Labels of each single camera and of all four together, by their names in metrics."""
CHOICES: dict[str, Rig] = dict(zip(CAMERA_LABELS, (*SINGLE, ALL), strict=True))
"""Rigs of each single camera and of all four cameras, by their names in metrics."""


@dataclass(frozen=True, slots=True)
class Turn:
    """The cameras of some episodes of a setting, with their faults."""

    cameras: tuple[CameraConfig, ...] = ()
    """All cameras of the rig; if empty, those of the scene."""
    faults: tuple[FaultConfig, ...] = ()
    """Faults of the cameras."""


def keep_cameras(rig: Sequence[CameraConfig], kept: Rig) -> Turn:
    """Return a turn in which only the given cameras of a rig work after the warm-up."""
    lost = tuple(camera.name for c, camera in enumerate(rig) if c not in kept)
    return Turn(tuple(rig), (FaultConfig("lost", lost, start_s=WARM_UP_S),) if lost else ())


def make_turns(scene: str, rigs: Sequence[Rig]) -> tuple[Turn, ...]:
    """Return one turn for each choice of the scene's cameras that work after the warm-up."""
    return tuple(keep_cameras(RIGS[scene], rig) for rig in rigs)


def delay(turn: Turn, latency_s: float, is_told: bool) -> Turn:
    """Return a turn in which images are delayed.

    Args:
        turn: the turn.
        latency_s: delay of the images [s].
        is_told: whether images carry their time stamps; otherwise they appear to be current.
    """
    if latency_s and is_told:
        cameras = tuple(replace(camera, latency_s=latency_s) for camera in turn.cameras)
        return Turn(cameras, turn.faults)
    n_steps = round(latency_s / DT_S)
    wrong = (FaultConfig("out_of_step", ("all",), float(n_steps)),) if n_steps else ()
    return Turn(turn.cameras, (*turn.faults, *wrong))
