"""Weights of the pose networks, which are downloaded on demand and stored in the user's cache.

The weights are those of Google's BlazePose (Apache-2.0). Every process verifies their checksums.
The detector and `full` are part of the official `mediapipe` wheel, which is never installed; `lite`
and `heavy` are part of Google's package on npm.
"""

import functools
import hashlib
import logging
import os
import tarfile
import tempfile
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from hrc_env.core import folders
from hrc_env.core.errors import DownloadError, WeightsError, make_unknown_name_error
from hrc_env.perception.downloads import download_file, download_wheel, read_member

log = logging.getLogger("hrc_env.weights")

WHEEL = "mediapipe==0.10.21"
"""Requirement specifier of the last release of mediapipe with the detector and `full`."""
WHEEL_BYTES = 35_622_638.0
"""Size of the mediapipe wheel [bytes]."""
TARBALL = "https://registry.npmjs.org/@mediapipe/pose/-/pose-0.5.1675469404.tgz"
"""Address of the npm package `@mediapipe/pose`, which contains all landmark networks."""
SETUP = "python -m hrc_env setup"
"""Command that fetches the default weights."""


@dataclass(frozen=True, slots=True)
class WeightsFile:
    """An official file of weights in an archive."""

    archive: str
    """Requirement specifier of the wheel, or address of the tarball, that contains the file."""
    member: str
    """Path of the file within the archive."""
    size_bytes: int
    """Size of the file [bytes]."""
    sha256: str
    """SHA-256 checksum of the file, in hexadecimal."""


WEIGHTS: dict[str, WeightsFile] = {
    "pose_detection": WeightsFile(
        WHEEL,
        "mediapipe/modules/pose_detection/pose_detection.tflite",
        2_959_046,
        "9ba9dd3d42efaaba86b4ff0122b06f29c4122e756b329d89dca1e297fd8f866c",
    ),
    "pose_landmark_full": WeightsFile(
        WHEEL,
        "mediapipe/modules/pose_landmark/pose_landmark_full.tflite",
        6_440_512,
        "e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f",
    ),
    "pose_landmark_lite": WeightsFile(
        TARBALL,
        "package/pose_landmark_lite.tflite",
        2_819_824,
        "f17bfbecadb61c3be1baa8b8d851cc6619c870a87167b32848ad20db306b9d61",
    ),
    "pose_landmark_heavy": WeightsFile(
        TARBALL,
        "package/pose_landmark_heavy.tflite",
        27_709_200,
        "59e42d71bcd44cbdbabc419f0ff76686595fd265419566bd4009ef703ea8e1fe",
    ),
}
"""All weights files, by name."""
ALWAYS = ("pose_detection", "pose_landmark_full")
"""Names of the weights of the default networks."""


def setup_command(names: Iterable[str]) -> str:
    """Return the command that downloads the named weights."""
    extra = [name.removeprefix("pose_landmark_") for name in names if name not in ALWAYS]
    return " ".join([SETUP, *(["--networks", *extra] if extra else [])])


def cache_dir() -> Path:
    """Return the folder in which weights are stored.

    It is $HRC_ENV_CACHE if that is set, else `hrc_env` in the user's cache folder, or a temporary
    folder if the latter is not writable.
    """
    if chosen := os.environ.get("HRC_ENV_CACHE"):
        return Path(chosen).expanduser()
    return folders.user_cache()


def find_weights(name: str) -> Path:
    """Return the path of a weights file.

    Raises `WeightsError` if the file is missing or not the official one.
    """
    if name not in WEIGHTS:
        raise make_unknown_name_error("weights", name, WEIGHTS)
    path = _path_of(name)
    if not path.is_file():
        raise WeightsError(
            f"The pose network's weights {path.name!r} are not in {path.parent}. Download them "
            f"once with: {setup_command([name])}"
        )
    _verify(name, path, path.stat().st_mtime_ns, path.stat().st_size)
    return path


def _path_of(name: str) -> Path:
    """Return the path at which a weights file is stored, which may be in a read-only cache."""
    usual, file = folders.usual_cache(), f"{name}.tflite"
    if not os.environ.get("HRC_ENV_CACHE") and usual is not None and (usual / file).is_file():
        return usual / file
    return cache_dir() / file


def fetch_weights(names: Iterable[str] = ALWAYS) -> dict[str, Path]:
    """Download missing weights, and return the paths of all requested ones by name.

    Raises:
        WeightsError: weights cannot be downloaded or written.
    """
    names = list(dict.fromkeys(names))
    found = {name: path for name in names if (path := _found(name)) is not None}
    if len(found) == len(names):
        return found
    folder = cache_dir()
    if not folders.can_write(folder):
        raise WeightsError(
            f"Weights cannot be written into {folder}. "
            f"Choose another folder with $HRC_ENV_CACHE, then run: {SETUP}"
        )
    with folders.alone(
        folder, lambda: log.warning("Waiting for the download by another process ...")
    ):
        missing = [name for name in names if _found(name) is None]
        for archive in dict.fromkeys(WEIGHTS[name].archive for name in missing):
            _fetch(archive, [name for name in missing if WEIGHTS[name].archive == archive], folder)
    return {name: find_weights(name) for name in names}


def _found(name: str) -> Path | None:
    """Return the path of a weights file, or None if it is missing or not the official one."""
    try:
        return find_weights(name)
    except WeightsError:
        return None


def _fetch(archive: str, names: list[str], folder: Path) -> None:
    """Download an archive, and unpack the named weights into a folder."""
    is_wheel, again = archive == WHEEL, setup_command(names)
    size = f", {WHEEL_BYTES / 1e6:.0f} MB" if is_wheel else ""
    name = archive if is_wheel else archive.rsplit("/", 1)[-1]
    log.warning(
        "Downloading the weights of the pose network (%s%s), only once, to %s ...",
        name,
        size,
        folder,
    )
    with tempfile.TemporaryDirectory() as scratch:
        try:
            if is_wheel:
                place = download_wheel(archive, Path(scratch), again, WHEEL_BYTES)
            else:
                place = download_file(archive, Path(scratch), again)
        except DownloadError as error:
            files = ", ".join(f"{name}.tflite" for name in names)
            raise WeightsError(
                f"{error} Without a network connection, copy {files} from the cache of another "
                f"machine to {folder} (or to the folder in $HRC_ENV_CACHE), or use "
                "perception='keypoints', which needs no weights."
            ) from error
        for name in names:
            _unpack(place, name)


@functools.cache
def _verify(name: str, path: Path, _mtime_ns: int, _size: int) -> None:
    """Raise `WeightsError` unless a file is the official one; cache successful verifications."""
    _check(name, path.read_bytes(), str(path))


def _check(name: str, content: bytes, origin: str) -> None:
    """Raise `WeightsError` unless `content` is that of the official file."""
    expected = WEIGHTS[name]
    checksum = hashlib.sha256(content).hexdigest()
    if checksum != expected.sha256:
        raise WeightsError(
            f"{origin} is not the official {name}.tflite: expected {expected.size_bytes} bytes "
            f"with sha256 {expected.sha256}, got {len(content)} bytes with sha256 {checksum}. "
            f"Download it again with: {setup_command([name])}"
        )


def _unpack(place: Path, name: str) -> None:
    """Extract a weights file from an archive, verify it, and store it in the cache."""
    try:
        content = read_member(place, WEIGHTS[name].member)
    except (zipfile.BadZipFile, tarfile.TarError, EOFError, KeyError) as error:
        raise WeightsError(
            f"{place.name} does not contain {WEIGHTS[name].member}: {error}. Try again with: "
            f"{setup_command([name])}"
        ) from error
    _check(name, content, f"{name}.tflite from {place.name}")
    folder = cache_dir()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, delete=False) as part:
            part.write(content)
        os.replace(part.name, folder / f"{name}.tflite")  # atomic: the whole file or nothing
    except OSError as error:
        raise WeightsError(
            f"Could not write the weights into {folder}: {error}. "
            f"Choose another folder with $HRC_ENV_CACHE, then run: {SETUP}"
        ) from error
