"""The pose network's weights: fetched once, checked always, kept in the user's cache folder.

Google's BlazePose (Apache-2.0): detector and `full` out of the official `mediapipe` wheel, which is
never installed; `lite` and `heavy`, when asked for, out of Google's package on npm.
"""

import functools
import hashlib
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import urllib.request
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from hrc_env.core.errors import DownloadError, WeightsError, unknown

WHEEL = "mediapipe==0.10.21"
"""The last release of mediapipe that carries both files."""
TARBALL = "https://registry.npmjs.org/@mediapipe/pose/-/pose-0.5.1675469404.tgz"
"""The package `@mediapipe/pose`, which carries all landmark networks."""
PATIENCE_S = 60.0
"""How long the server of npm may be silent."""
SETUP = "python -m hrc_env setup"


@dataclass(frozen=True, slots=True)
class WeightsFile:
    """One official file: in which archive it lies and what it must be."""

    archive: str
    member: str
    size_bytes: int
    sha256: str


WEIGHTS: dict[str, WeightsFile] = {
    "pose_detection": WeightsFile(
        WHEEL, "mediapipe/modules/pose_detection/pose_detection.tflite", 2_959_046,
        "9ba9dd3d42efaaba86b4ff0122b06f29c4122e756b329d89dca1e297fd8f866c",
    ),
    "pose_landmark_full": WeightsFile(
        WHEEL, "mediapipe/modules/pose_landmark/pose_landmark_full.tflite", 6_440_512,
        "e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f",
    ),
    "pose_landmark_lite": WeightsFile(
        TARBALL, "package/pose_landmark_lite.tflite", 2_819_824,
        "f17bfbecadb61c3be1baa8b8d851cc6619c870a87167b32848ad20db306b9d61",
    ),
    "pose_landmark_heavy": WeightsFile(
        TARBALL, "package/pose_landmark_heavy.tflite", 27_709_200,
        "59e42d71bcd44cbdbabc419f0ff76686595fd265419566bd4009ef703ea8e1fe",
    ),
}  # fmt: skip
ALWAYS = ("pose_detection", "pose_landmark_full")
"""What the defaults need."""


def setup_for(names: Iterable[str]) -> str:
    """The command that fetches weights."""
    extra = [name.removeprefix("pose_landmark_") for name in names if name not in ALWAYS]
    return " ".join([SETUP, *(["--networks", *extra] if extra else [])])


def cache_dir() -> Path:
    """The folder that keeps the weights: $HRC_ENV_CACHE, or `hrc_env` in the user's caches."""
    if chosen := os.environ.get("HRC_ENV_CACHE"):
        return Path(chosen).expanduser()
    chosen = os.environ.get("XDG_CACHE_HOME")
    if sys.platform == "win32":
        chosen = chosen or os.environ.get("LOCALAPPDATA")
    usual = {"darwin": "~/Library/Caches", "win32": "~/AppData/Local"}.get(sys.platform, "~/.cache")
    return Path(chosen or usual).expanduser() / "hrc_env"


def find_weights(name: str) -> Path:
    """A weights file, checked once per process. Raises `WeightsError` if missing or another."""
    if name not in WEIGHTS:
        raise unknown("weights", name, WEIGHTS)
    path = cache_dir() / f"{name}.tflite"
    if not path.is_file():
        raise WeightsError(
            f"The pose network's weights {path.name!r} are not in {path.parent}. "
            f"Fetch them once with: {setup_for([name])}"
        )
    _verified(name, path, path.stat().st_mtime_ns, path.stat().st_size)
    return path


def fetch_weights(names: Iterable[str] = ALWAYS) -> dict[str, Path]:
    """Weights by name; downloads what is not there yet. Raises `WeightsError` where that fails."""
    found, missing = {}, []
    for name in names:
        try:
            found[name] = find_weights(name)
        except WeightsError:
            missing.append(name)
    for archive in dict.fromkeys(WEIGHTS[name].archive for name in missing):
        with tempfile.TemporaryDirectory() as folder:
            download = download_wheel if archive == WHEEL else _download_tarball
            try:
                place = download(archive, Path(folder), setup_for(missing))
            except DownloadError as error:
                raise WeightsError(str(error)) from error
            for name in (each for each in missing if WEIGHTS[each].archive == archive):
                _unpack(place, name)
                found[name] = find_weights(name)
    return found


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
            f"Fetch it anew with: {setup_for([name])}"
        )


def download_wheel(requirement: str, folder: Path, again: str) -> Path:
    """A wheel (`name==1.2.3`), downloaded into a folder by pip as it is configured, for a platform
    and a Python that matter not: it is unzipped. Errors as of `pip_download`."""
    options = ["--only-binary=:all:", "--python-version", "3.11", "--ignore-requires-python"]
    for platform in ("manylinux_2_28_x86_64", "manylinux2014_x86_64"):
        options += ["--platform", platform]
    return pip_download([*options, requirement], requirement, folder, again)


def pip_download(options: list[str], requirement: str, folder: Path, again: str) -> Path:
    """What `pip download OPTIONS` puts into an empty folder, without dependencies. Raises
    `DownloadError`, which names the requirement and the command `again`."""
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps"]
    command += ["--disable-pip-version-check", "--dest", str(folder), *options]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    came = sorted(folder.iterdir())
    if result.returncode == 0 and came:
        return came[0]
    if "No module named pip" in result.stderr:
        raise DownloadError(
            f"pip is needed to download {requirement}, and {sys.executable} has none. "
            f"Add it with: python -m ensurepip, then run: {again}"
        )
    said = (result.stderr.strip().splitlines() or ["nothing"])[-1].strip()
    raise DownloadError(
        f"Could not download {requirement} (is there a network?). pip said: {said} "
        f"Try again with: {again}"
    )


def _download_tarball(url: str, folder: Path, again: str) -> Path:
    place = folder / url.rsplit("/", 1)[-1]
    try:
        with urllib.request.urlopen(url, timeout=PATIENCE_S) as answer, place.open("wb") as file:
            shutil.copyfileobj(answer, file)
    except OSError as error:
        raise DownloadError(
            f"Could not download {url} (is there a network?): {error}. Try again with: {again}"
        ) from error
    return place


def _unpack(place: Path, name: str) -> None:
    """One file out of an archive into the cache, checked before it appears there."""
    try:
        content = member_of(place, WEIGHTS[name].member)
    except (zipfile.BadZipFile, tarfile.TarError, EOFError, KeyError) as error:
        raise WeightsError(
            f"{place.name} does not hold {WEIGHTS[name].member}: {error}. "
            f"Try again with: {setup_for([name])}"
        ) from error
    _check(name, content, f"{name}.tflite from {place.name}")
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


def member_of(place: Path, name: str) -> bytes:
    """A file out of a wheel or a tarball; `KeyError` where it holds none of that name."""
    if place.suffix == ".whl":
        with zipfile.ZipFile(place) as wheel:
            return wheel.read(name)
    with tarfile.open(place) as tarball:
        file = tarball.extractfile(name)
        if file is None:
            raise KeyError(name)
        return file.read()
