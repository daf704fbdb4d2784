"""Selection of the scenes that have room for a clip of recorded motion."""

from collections.abc import Mapping

from hrc_env.motion.activities.pieces import NoRoomError, cut_clips, make_stage
from hrc_env.motion.anatomy import measure_bodies
from hrc_env.motion.clip import Clip
from hrc_env.motion.config import MotionConfig
from hrc_env.motion.floorplan import make_floorplan
from hrc_env.worker.body import load_bodies, select_bodies
from hrc_env.world import Grounds


def measure_played_s(
    clip: Clip,
    grounds: Mapping[str, Grounds],
    worker: str | tuple[str, ...] = "worker_1",
    config: MotionConfig | None = None,
) -> dict[str, float]:
    """Return the duration of the part of a clip that fits in each scene [s]; 0 if none fits.

    Args:
        clip: recorded motion.
        grounds: floors of scenes, by name (`scene.build.all_grounds`).
        worker: bodies of the workers, in the format of `HRCConfig.worker`.
        config: settings of the workers' motion; None for the default.

    Raises:
        ConfigError: the clip has no two frames with both feet on the floor between which it can be
            played.
    """
    lengths, played_s = (
        measure_bodies(load_bodies(select_bodies(worker))).lengths,
        dict[str, float](),
    )
    for name, ground in grounds.items():
        stage = make_stage(make_floorplan(ground), config or MotionConfig())
        try:
            played_s[name] = cut_clips([clip], lengths, stage).duration_s
        except NoRoomError:
            played_s[name] = 0.0
    return played_s


def describe_fit(clip: Clip, played: dict[str, float]) -> str:
    """Return a text on the scenes in which a clip can be played.

    Args:
        clip: recorded motion.
        played: result of `measure_played_s`.
    """
    whole_s = (len(clip.controls) - 1) / clip.fps
    plays = [f"{name} ({s:.1f} of its {whole_s:.1f} s)" for name, s in played.items() if s > 0.0]
    lacks = [name for name, s in played.items() if s == 0.0]
    sentences = [f"It can be played in {', '.join(plays)}."] if plays else []
    if lacks:
        sentences.append(f"There is no room for it in {', '.join(lacks)}.")
    return " ".join(sentences)
