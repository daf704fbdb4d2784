"""Cache of rendered clips on disk, from which an interrupted run continues."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from assets.emulator.clips import Clip
from assets.emulator.watch import BodyOf, Watched, load, save, watch
from hrc_env.config import HRCConfig
from hrc_env.core.typing import Floats
from hrc_env.experiments.versions import make_key
from hrc_env.worker.body import load_body

DEPENDS = ("env", "tracker", "emulator", "detector", "motion")
"""Subsystems that decide the detections of clips."""


def watch_cached(
    level: str,
    clips: Sequence[Clip],
    config: HRCConfig,
    folder: Path | None,
    body_of: BodyOf = load_body,
) -> Iterator[Watched]:
    """Yield the detections of clips at a level, from the folder if present, else played and saved
    there.

    Clips of other versions or settings do not count. Neither do clips with other reported
    deviations, other offsets of joints or other joint positions in a body (`watch`).
    """
    if folder is None:
        yield from watch(level, clips, config, body_of)
        return
    known = config.emulator.make_calibration()
    told = _digest(known.sigma, known.offset_m, known.wander_m, known.between_m)
    settings = {"level": level, "detector": asdict(config.detector), "told": told}
    key = make_key(settings, DEPENDS)
    joints = {clip.body: _digest(body_of(clip.body).joint_offset) for clip in clips}
    paths = [folder / f"{_name(clip, key + joints[clip.body])}.npz" for clip in clips]
    todo = [clip for clip, path in zip(clips, paths, strict=True) if not path.exists()]
    fresh = watch(level, todo, config, body_of)
    for path in paths:
        if not path.exists():
            save(path, next(fresh))
        yield load(path)


def _digest(*arrays: Floats) -> str:
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()


def _name(clip: Clip, key: str) -> str:
    text = json.dumps([asdict(clip), key], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:20]
