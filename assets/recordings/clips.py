"""Recordings of people in packages under a free licence, as clips that workers play.

A clip has a role: keypoint offsets may be fitted on some ("fitted") and are validated on the others
("validated"), which come from other packages and, as far as known, other people. Footage of
demonstrations, of unknown ground truth, has neither role.
"""

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from assets.recordings.archives import fetch
from assets.recordings.foreign import READERS, read_joints
from assets.recordings.sources import SOURCES
from assets.recordings.synthetic import make_clips
from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Points3
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.person import span
from hrc_env.mocap.read import read_recording
from hrc_env.mocap.record import Capture
from hrc_env.mocap.retarget import RetargetError, retarget
from hrc_env.motion.clip import Clip
from hrc_env.worker.body import Body, load_body

AGAIN = "python -m assets.recordings.clips"
FASTEST_HZ = 60.0
"""Faster recordings are reduced to this rate."""
FADE_S = 0.2
"""Time in which a repeated motion returns to its beginning."""
Role = Literal["fitted", "validated"]


@dataclass(frozen=True, slots=True)
class Recorded:
    """A piece of a recording."""

    name: str
    source: str
    """Key of `SOURCES`."""
    file: str
    """Path in the source's folder."""
    motion: str
    """Motion of the person."""
    first_s: float
    last_s: float
    """Beginning and end of the piece in the recording [s]."""
    times: int = 1
    """Number of repetitions: a stride is short."""

    @property
    def role(self) -> Role:
        """Role of the clip, by its source."""
        return SOURCES[self.source].role

    @property
    def seconds(self) -> float:
        """Duration [s]."""
        return self.times * (self.last_s - self.first_s)


def clips_of(
    role: Role | None = None, say: Callable[[str], None] = print, body: Body | None = None
) -> Iterator[tuple[Recorded, Clip, RetargetError]]:
    """Yield each clip of a role (None: both), made for a body (None: worker_1), and its retargeting
    error.

    Clips that are not in the cache folder are downloaded.

    Raises:
        DownloadError: a package is missing and cannot be downloaded, or is another than expected.
    """
    body = body or load_body()
    for recorded in CLIPS:
        if role in (None, recorded.role):
            capture = read_capture(recorded, fetch(SOURCES[recorded.source].archive, say, AGAIN))
            if recorded.times > 1:
                joints = repeat(capture.joints_world, recorded.times, capture.fps)
                capture = replace(capture, joints_world=joints)
            clip, error = retarget(capture, body)
            yield recorded, replace(clip, source=recorded.name), error


def read_capture(recorded: Recorded, folder: Path) -> Capture:
    """Read a piece of a recording in a folder with the project's importer.

    Raises:
        ConfigError: the file is missing, damaged, or ends before the piece.
    """
    path = folder / recorded.file
    if not path.is_file():
        raise ConfigError(f"{path} is missing. Remove {folder}, then run: {AGAIN}")
    if path.suffix in READERS:
        joints, fps = read_joints(path)
        with tempfile.TemporaryDirectory() as scratch:
            place = Path(scratch) / f"{recorded.name}.npz"
            np.savez(place, joints=joints[_rows(recorded, len(joints), fps)], fps=fps)
            return read_recording(place, min(fps, FASTEST_HZ))
    whole = read_recording(path)
    whole = read_recording(path, min(whole.fps, FASTEST_HZ))
    rows = _rows(recorded, len(whole.joints_world), whole.fps)
    return replace(whole, joints_world=whole.joints_world[rows])


def repeat(joints: Points3, times: int, fps: float) -> Points3:
    """Repeat a motion, each time from the position and heading at which the last repetition ended.

    Returns (T', 15, 3) joints; the difference of its end and beginning fades within `FADE_S`.
    """
    fading = np.linspace(1.0, 0.0, max(2, round(FADE_S * fps)))[:, None, None]
    done = joints
    for _ in range(times - 1):
        ends, begins = (
            span(pose, "hip") + span(pose, "shoulder") for pose in (done[-1], joints[0])
        )
        turn = about_axis("z", np.arctan2(ends[1], ends[0]) - np.arctan2(begins[1], begins[0]))
        again = (joints - joints[0].mean(0)) @ turn.T
        again[..., :2] += done[-1].mean(0)[:2]
        again[..., 2] += joints[0, :, 2].mean()
        n = min(len(fading), len(again))
        again[:n] += fading[:n] * (done[-1] - again[0])
        done = np.concatenate([done, again[1:]])
    return done


def _heading(pose: Points3) -> float:
    """Return the heading of hips and shoulders (15, 3) [rad]."""
    way = span(pose, "hip") + span(pose, "shoulder")
    return float(np.arctan2(way[1], way[0]))


def _rows(recorded: Recorded, n_frames: int, fps: float) -> slice:
    """Return the frames of a piece."""
    first, last = (round(at_s * fps) for at_s in (recorded.first_s, recorded.last_s))
    if not first < last < n_frames + 0.5 * fps:
        raise ConfigError(
            f"{recorded.file}: {recorded.name} is {recorded.first_s:g} to {recorded.last_s:g} s of "
            f"it, but it lasts {n_frames / fps:.2f} s."
        )
    return slice(first, last + 1)


def _pieces(
    source: str, file: str, *pieces: tuple[float, float, str], times: int = 1
) -> tuple[Recorded, ...]:
    """Return pieces of a recording, given as beginning, end [s] and motion.

    Their names are numbered if there are several of one file.
    """
    stem = "-".join(dict.fromkeys((source, Path(file).stem.removeprefix(f"{source}_"))))
    return tuple(
        Recorded(
            stem if len(pieces) == 1 else f"{stem}-{k}", source, file, motion, first, last, times
        )
        for k, (first, last, motion) in enumerate(pieces)
    )


CLIPS: tuple[Recorded, ...] = (
    *_pieces(
        "climb", "climb_0.npy",
        (0.0, 2.3, "stands, begins to walk"),
        (3.1, 5.6, "stands, bends down"),
        (10.5, 15.0, "gets up from hands and knees, squats"),
    ),
    *_pieces(
        "climb", "climb_1.npy",
        (0.0, 4.2, "stands, bows"),
        (7.5, 12.8, "gets up from a squat, stands, squats"),
        (15.4, 20.1, "walks, turns, stands"),
    ),
    *_pieces(
        "climb", "climb_2.npy",
        (0.0, 2.6, "walks"),
        (3.1, 6.4, "stands, turns, bends down"),
        (7.5, 13.8, "gets up from a squat, turns round, squats"),
        (18.0, 21.5, "walks, turns"),
        (21.5, 25.0, "stands"),
    ),
    *_pieces(
        "climb", "climb_3.npy",
        (7.0, 12.6, "gets up, turns round, squats"),
        (13.3, 16.4, "turns round"),
        (17.1, 20.0, "walks, turns"),
    ),
    *_pieces(
        "climb", "climb_4.npy",
        (0.0, 5.0, "stands, bends down to the floor"),
        (16.8, 19.1, "stands"),
    ),
    *_pieces(
        "jump", "jump.amc",
        (0.0, 5.7, "wipes the face, jumps forward"),
        (5.7, 11.4, "crouches, jumps forward"),
        (11.4, 17.1, "crouches, jumps turning round"),
        (17.1, 22.9, "jumps forward, gestures"),
    ),
    *_pieces("shoelace", "kneel.bvh", (0.0, 15.1, "stands, kneels down, ties a shoe, gets up")),
    *_pieces("amp", "walk.npz", (0.0, 2.5, "walks")),
    *_pieces(
        "amp", "dance.npz", (0.0, 5.0, "dances"), (5.0, 10.0, "dances"), (10.0, 15.0, "dances")
    ),
    *_pieces("mimic", "jump.txt", (0.0, 1.7, "jumps")),
    *_pieces("mimic", "dance_a.txt", (0.0, 1.6, "dances"), times=2),
    *_pieces("mimic", "dance_b.txt", (0.0, 2.5, "dances")),
    *_pieces("mimic", "kick.txt", (0.0, 1.5, "kicks")),
    *_pieces("mimic", "punch.txt", (0.0, 2.1, "punches")),
    *_pieces("mimic", "spinkick.txt", (0.0, 1.2, "kicks turning round")),
    *_pieces("mimic", "walk.txt", (0.0, 1.2, "walks"), times=3),
    *_pieces("mimic", "walk_forward.txt", (0.0, 1.2, "walks"), times=3),
    *_pieces("mimic", "turn_left0.txt", (0.0, 1.2, "walks to the left"), times=3),
    *_pieces("mimic", "turn_left1.txt", (0.0, 1.2, "walks to the left"), times=4),
    *_pieces("mimic", "turn_right0.txt", (0.0, 1.2, "walks to the right"), times=4),
    *_pieces("mimic", "turn_right1.txt", (0.0, 1.2, "walks to the right"), times=4),
)  # fmt: skip
"""All clips. Recordings that the importer refuses are left out (people lying, rolling, crawling, on
their hands, going up and down), as are runners (a clip is played from one moment on both feet to
another), robots and animals. People on a box are put on the floor."""


def main() -> None:
    """Download or make all clips, import them, and print their retargeting errors."""
    for recorded, clip, error in (*clips_of(), *make_clips()):
        mean_cm, p95_cm = 100 * error.mean_m.mean(), 100 * error.p95_m.max()
        print(
            f"{recorded.name:22} {recorded.role:10} {len(clip.controls) / clip.fps:5.2f} s  "
            f"mean {mean_cm:4.1f} cm, worst joint p95 {p95_cm:4.1f} cm  {recorded.motion}"
        )


if __name__ == "__main__":
    main()
