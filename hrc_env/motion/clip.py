"""Clips, which are recorded motion as control vectors, for playback by workers of any size."""

import io
import zipfile
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from hrc_env.core.errors import ConfigError, check_shape
from hrc_env.core.results import write_whole
from hrc_env.core.typing import Bools, Floats
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import ANKLE_Z, ARM, BALL_X, BALL_Z, HEEL_X, LEG, N_SIZES, STAND_Z
from hrc_env.motion.curves import pivot_foot

VERSION = 1
"""Version of the file format, which increases with each change of columns or fields."""
RECORDED = np.array([*range(c.N_BLENDED), *range(c.ANKLE, c.ANKLE + 12)])
"""Columns (32,) of the control vector that are recorded: the blended columns and the feet."""
SLOWEST_HZ = 5.0
"""Lowest plausible frame rate [Hz]. The value is an estimate."""
FASTEST_HZ = 1000.0
"""Highest plausible frame rate [Hz]. The value is an estimate."""
FARTHEST_M = 200.0
"""Maximum plausible distance of the root from the origin [m]. The value is an estimate."""
FASTEST_M_S = 15.0
"""Maximum plausible speed of the root [m/s]. The value is an estimate."""


@dataclass(frozen=True, slots=True, eq=False)
class Clip:
    """Recorded motion that can be played by workers; it begins at the origin, facing +x."""

    controls: Floats
    """Control vectors (T, N_CONTROLS); columns outside of `RECORDED` are zero."""
    fps: float
    """Frame rate [Hz]."""
    contacts: Bools
    """Mask (T, 2) of the frames in which the left and the right foot stand on the floor."""
    size: Floats
    """Body dimensions (N_SIZES,) to which the motion applies [m], as in `Anatomy.lengths`."""
    source: str
    """Name of the recording."""

    def __post_init__(self) -> None:
        """Check that shapes are correct, values finite, and speeds plausible for a person."""
        q, source = self.controls, self.source
        check_rate(self.fps, source)
        if q.ndim != 2 or len(q) < 2 or q.shape[1] != c.N_CONTROLS:
            raise ConfigError(
                f"{source}: controls must have shape (T >= 2, {c.N_CONTROLS}), got {q.shape}."
            )
        check_shape(f"{source}: contacts", self.contacts.shape, (len(q), 2), "frames, feet")
        check_shape(f"{source}: size", self.size.shape, (N_SIZES,), "lengths")
        if not (np.isfinite(q).all() and np.isfinite(self.size).all() and self.size[LEG] > 0.0):
            raise ConfigError(f"{source}: controls and size must be finite numbers.")
        root = q[:, [c.ROOT_X, c.ROOT_Y]]
        speed = np.linalg.norm(np.diff(root, axis=0), axis=-1).max() * self.fps
        if np.abs(root).max() > FARTHEST_M or speed > FASTEST_M_S:
            raise ConfigError(
                f"{source}: the root moves {np.abs(root).max():.0f} m at up to {speed:.0f} m/s; at "
                f"most {FARTHEST_M:g} m and {FASTEST_M_S:g} m/s are expected of a person."
            )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Clip) and all(
            np.array_equal(getattr(self, item.name), getattr(other, item.name))
            for item in fields(self)
        )

    def __hash__(self) -> int:
        return hash((self.source, self.fps, len(self.controls)))


def move_to_origin(controls: Floats) -> Floats:
    """Transform control vectors to begin with the root at the origin, facing +x."""
    out = controls.copy()
    x, y, yaw = controls[0, [c.ROOT_X, c.ROOT_Y, c.HEADING]]
    cos, sin = np.cos(yaw), np.sin(yaw)
    for at in (c.ROOT_X, c.ANKLE, c.ANKLE + 6):
        dx, dy = controls[:, at] - x, controls[:, at + 1] - y
        out[:, at], out[:, at + 1] = cos * dx + sin * dy, cos * dy - sin * dx
    for at in (c.HEADING, c.ANKLE + 3, c.ANKLE + 9):
        out[:, at] -= yaw
    return out


def scale_clip(clip: Clip, size: Floats) -> Floats:
    """Return the control vectors (T, N_CONTROLS) for a worker of dimensions (N_SIZES,) [m].

    Paths scale with the length of the legs, and the reach of the hands with that of the arms.
    """
    out, legs = clip.controls.copy(), size[LEG] / clip.size[LEG]
    out[:, [c.ROOT_X, c.ROOT_Y]] *= legs
    out[:, c.PELVIS_Z] = size[STAND_Z] + legs * (out[:, c.PELVIS_Z] - clip.size[STAND_Z])
    out[:, c.HAND_OFFSET : c.HAND_OFFSET + 6] *= size[ARM] / clip.size[ARM]
    for at in (c.ANKLE, c.ANKLE + 6):
        out[:, [at, at + 1]] *= legs
        out[:, at + 2] = size[ANKLE_Z] + legs * (out[:, at + 2] - clip.size[ANKLE_Z])
    return out


def save_clip(clip: Clip, path: Path) -> None:
    """Write a clip to an .npz file atomically."""
    arrays = {item.name: getattr(clip, item.name) for item in fields(clip)}
    arrays["controls"] = clip.controls[:, RECORDED]
    file = io.BytesIO()
    np.savez_compressed(file, version=VERSION, **arrays)
    write_whole(path, file.getvalue())


def load_clip(path: Path) -> Clip:
    """Read a clip from a file that `save_clip` or `import-motion` wrote.

    Raises:
        ConfigError: the file is not a clip, is damaged, or has another version.
    """
    names = {item.name for item in fields(Clip)}
    try:
        with np.load(path, allow_pickle=False) as file:
            stored = set(file.files)
            version = int(file["version"]) if "version" in stored else 0
            arrays = {name: file[name] for name in names & stored}
    except FileNotFoundError:
        raise ConfigError(f"The clip {path} does not exist.") from None
    except (zipfile.BadZipFile, ValueError, EOFError, OSError, KeyError) as error:
        raise ConfigError(f"{path} is damaged or not a clip: {error}.") from None
    if version != VERSION or set(arrays) != names:
        got = f"version {version}" if version else f"arrays {', '.join(sorted(stored)) or 'none'}"
        raise ConfigError(
            f"{path}: expected a clip of version {VERSION}, got {got}. Create it again with: "
            f"python -m hrc_env import-motion RECORDING --out {path}"
        )
    recorded = np.asarray(arrays["controls"], float)
    if recorded.ndim != 2 or recorded.shape[1] != len(RECORDED):
        raise ConfigError(f"{path}: controls must be (T, {len(RECORDED)}), got {recorded.shape}.")
    controls = np.zeros((len(recorded), c.N_CONTROLS))
    controls[:, RECORDED] = recorded
    contacts, size = np.asarray(arrays["contacts"], bool), np.asarray(arrays["size"], float)
    return Clip(controls, float(arrays["fps"]), contacts, size, str(arrays["source"]))


def check_rate(fps: float, source: str) -> None:
    """Raise `ConfigError` if a frame rate [Hz] is outside of the plausible range."""
    if not SLOWEST_HZ <= fps <= FASTEST_HZ:
        raise ConfigError(
            f"{source}: a frame rate between {SLOWEST_HZ:g} and {FASTEST_HZ:g} frames per second "
            f"is expected, but the file has {fps:g}. If you know the correct one, pass it "
            "(--source-fps)."
        )


def find_footprints(feet: Floats, size: Floats) -> Floats:
    """Return the ankle positions and headings (T, 4) of a foot if it were flat [m, rad].

    Args:
        feet: pose (T, 5 or more) of a foot: ankle position (3) [m], heading and pitch [rad].
        size: dimensions (N_SIZES,) of the body [m].
    """
    flat = feet[:, :3] - shift_by_roll(feet[:, 3], feet[:, 4], size)
    return np.concatenate([flat, feet[:, 3:4]], axis=1)


def shift_by_roll(yaw: Floats, pitch: Floats, size: Floats) -> Floats:
    """Return the displacement (T, 3) of an ankle due to the pitch of its foot [m].

    Args:
        yaw: heading (T,) of the foot [rad].
        pitch: pitch (T,) of the foot [rad], about the ball if positive, else about the heel.
        size: dimensions (N_SIZES,) of the body [m].
    """
    ball, heel = (size[BALL_X], size[BALL_Z]), (size[HEEL_X], -size[ANKLE_Z])
    ahead, above = np.array([pivot_foot(p, *(ball if p > 0.0 else heel)) for p in pitch.tolist()]).T
    return np.stack([np.cos(yaw) * ahead, np.sin(yaw) * ahead, above], -1)
