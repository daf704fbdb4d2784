"""Download of a recording, which is verified and stored in the user's cache folder.

`Demo_SinglePerson` of Pose2Sim (D. Pagnon et al., BSD-3-Clause): four calibrated cameras film a man
who balances on a beam beside a bystander; 100 frames at 60 Hz. The recording is extracted from the
official wheel of Pose2Sim, which is not installed.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from assets.recordings.archives import Archive, fetch

AGAIN = "python -m benchmarks tracking --real"
_CALIBRATION = "calibration/Calib.qca.txt"
_FILMS = tuple(f"videos/cam0{k}.mp4" for k in (1, 2, 3, 4))
POSE2SIM = Archive(
    "pose2sim==0.10.49",
    "403e0dc4065898ba6a595e72a8970950310979253d60e24c2e00b16b36bf21e1",
    51, "pose2sim-0.10.49-single-person",
    {
        **{name: f"Pose2Sim/Demo_SinglePerson/{name}" for name in (_CALIBRATION, *_FILMS)},
        "LICENSE": "pose2sim-0.10.49.dist-info/licenses/LICENSE",
    },
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Recording:
    """The files of a recording."""

    calibration: Path
    films: tuple[Path, ...]


def fetch_recording(say: Callable[[str], None]) -> Recording:
    """Return the recording in the cache folder; download it if it is missing.

    Args:
        say: function that receives messages about the progress.

    Raises:
        DownloadError: there is no network or pip, the wheel is not the expected one, or the folder
            is not writable.
    """
    folder = fetch(POSE2SIM, say, AGAIN)
    return Recording(folder / _CALIBRATION, tuple(folder / name for name in _FILMS))
