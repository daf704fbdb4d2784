"""Rigs in files: TOML, a `[[camera]]` for each.

[[camera]]
name = "left"
eye_world = [2.9, 2.6, 2.45]
lens = {model = "kannala_brandt", coefficients = [0.0667]}

The fields are those of `CameraConfig`; a name and a place are needed, the rest has defaults.
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError
from hrc_env.core.mapping import from_mapping
from hrc_env.core.toml import read_toml, to_toml
from hrc_env.geometry.camera_config import CameraConfig


def read_rig(path: Path | str) -> tuple[CameraConfig, ...]:
    """The cameras of a rig file.

    Raises:
        ConfigError: no such file, no TOML, or a field that is unknown, missing or wrong.
    """
    return rig_from(read_toml(path), str(path))


def rig_from(content: dict[str, Any], where: str) -> tuple[CameraConfig, ...]:
    """The cameras of a file's content.

    Raises:
        ConfigError: a field that is unknown, missing or wrong.
    """
    others = sorted(set(content) - {"camera"})
    entries = content.get("camera", [])
    tables = isinstance(entries, list) and all(isinstance(entry, dict) for entry in entries)
    if others or not tables or not entries:
        raise ConfigError(
            f"{where} must hold a [[camera]] for each camera and nothing else, "
            f"got {', '.join(map(repr, others)) or 'no camera'}."
        )
    cameras = []
    for k, entry in enumerate(entries):
        try:
            cameras.append(from_mapping(CameraConfig, entry, f"camera[{k}]."))
        except ConfigError as error:
            raise ConfigError(f"{where}: {error}") from error
    return tuple(cameras)


def write_rig(path: Path | str, cameras: Sequence[CameraConfig]) -> None:
    """Write a rig, every field of every camera, so that `read_rig` gives the same back."""
    content = to_toml({"camera": [dataclasses.asdict(camera) for camera in cameras]})
    Path(path).write_text(content, encoding="utf-8")
