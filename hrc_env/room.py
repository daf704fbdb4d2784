"""In which scenes a clip of recorded motion has room; what of a task is within an arm's reach."""

from typing import Any

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.motion.activities.pieces import NoRoomError, stage, stocked
from hrc_env.motion.anatomy import anatomies
from hrc_env.motion.clip import Clip
from hrc_env.motion.floorplan import floorplan
from hrc_env.scene.build import SCENES, Scene, build
from hrc_env.tasks import reach_target
from hrc_env.tasks.reach_target import ReachTarget
from hrc_env.tasks.task import Task
from hrc_env.worker.body import pool, stack


def played_s(clip: Clip, config: HRCConfig | None = None) -> dict[str, float]:
    """How much of a clip workers of these settings play, by scene [s]; 0: it has no room there.

    Raises:
        ConfigError: there are no two moments with both feet on the floor, so that nobody plays it.
    """
    config = config or HRCConfig()
    size, found = anatomies(stack(pool(config.worker))).size, dict[str, float]()
    for name in SCENES:
        where = stage(floorplan(build(config.scene, name).grounds), config.motion)
        try:
            found[name] = stocked([clip], size, where).lasts_s
        except NoRoomError:
            found[name] = 0.0
    return found


def told(clip: Clip, played: dict[str, float]) -> str:
    """The same in a sentence or two."""
    whole_s = (len(clip.controls) - 1) / clip.fps
    plays = [f"{name} ({s:.1f} of its {whole_s:.1f} s)" for name, s in played.items() if s > 0.0]
    lacks = [name for name, s in played.items() if s == 0.0]
    said = [f"It plays in {', '.join(plays)}."] if plays else []
    return " ".join([*said, f"It has no room in {', '.join(lacks)}."] if lacks else said)


def check_reach(task: Task[Any, Any], scene: Scene) -> None:
    """Raise `ConfigError` for an arm that is too short for where a task has it get to, or for what
    lies loose there."""
    loose, size_m = scene.objects, np.linalg.norm(scene.objects.half_size_m, axis=1)
    places = zip(loose.names, scene.model.body_pos[scene.object_bodies], size_m, strict=True)
    lying = [ReachTarget(f"object {name!r}", at, within_m=size) for name, at, size in places]
    targets = [*task.reach_targets(), *lying]
    reach_target.check_reach(task.id, scene.robot.name, scene.chain, targets)
