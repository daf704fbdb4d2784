"""In which scenes a clip of recorded motion has room."""

from collections.abc import Mapping

from hrc_env.motion.activities.pieces import NoRoomError, stage, stocked
from hrc_env.motion.anatomy import anatomies
from hrc_env.motion.clip import Clip
from hrc_env.motion.config import MotionConfig
from hrc_env.motion.floorplan import floorplan
from hrc_env.worker.body import pool, stack
from hrc_env.world import Grounds


def played_s(
    clip: Clip,
    grounds: Mapping[str, Grounds],
    worker: str | tuple[str, ...] = "worker_1",
    config: MotionConfig | None = None,
) -> dict[str, float]:
    """Return how much of a clip workers play, by scene [s]; 0: it has no room there.

    Args:
        clip: of recorded motion.
        grounds: where people can walk, by the names of scenes (`scene.build.all_grounds`).
        worker: the bodies, as `HRCConfig.worker` has them.
        config: settings of the workers' motion; None: the default.

    Raises:
        ConfigError: there are no two moments with both feet on the floor, so that nobody plays it.
    """
    size, found = anatomies(stack(pool(worker))).size, dict[str, float]()
    for name, ground in grounds.items():
        where = stage(floorplan(ground), config or MotionConfig())
        try:
            found[name] = stocked([clip], size, where).lasts_s
        except NoRoomError:
            found[name] = 0.0
    return found


def describe_fit(clip: Clip, played: dict[str, float]) -> str:
    """Return in a sentence or two where a clip plays, of what `played_s` found."""
    whole_s = (len(clip.controls) - 1) / clip.fps
    plays = [f"{name} ({s:.1f} of its {whole_s:.1f} s)" for name, s in played.items() if s > 0.0]
    lacks = [name for name, s in played.items() if s == 0.0]
    said = [f"It plays in {', '.join(plays)}."] if plays else []
    return " ".join([*said, f"It has no room in {', '.join(lacks)}."] if lacks else said)
