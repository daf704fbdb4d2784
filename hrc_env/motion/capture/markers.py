"""`npz` files with `joints (T, 15, 3)` and `fps`."""

import zipfile
from pathlib import Path

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINTS, N_JOINTS
from hrc_env.core.typing import Points3
from hrc_env.motion.capture.rows import FEWEST_FRAMES


def read_joints(path: Path) -> tuple[Points3, float]:
    """Joints (T, 15, 3) in any unit, missing ones NaN, and frames a second.

    Raises:
        ConfigError: no such arrays in it, or the file is damaged.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            names = tuple(file.files)
            arrays = {name: np.asarray(file[name], float) for name in names if name in _WANTED}
    except (zipfile.BadZipFile, ValueError, EOFError, OSError, KeyError) as error:
        raise ConfigError(f"{path.name} is cut off or no npz file: {error}.") from None
    missing = [name for name in _WANTED if name not in arrays]
    if missing:
        raise ConfigError(
            f"{path.name}: expected arrays joints (T, {N_JOINTS}, 3) and fps, "
            f"found {', '.join(names) or 'none'}; missing {', '.join(missing)}."
        )
    joints, fps = arrays["joints"], arrays["fps"]
    if joints.ndim != 3 or joints.shape[1:] != (N_JOINTS, 3) or len(joints) < FEWEST_FRAMES:
        raise ConfigError(
            f"{path.name}: joints must be (T >= {FEWEST_FRAMES}, {N_JOINTS}, 3), one row each of "
            f"{', '.join(JOINTS)}; got {joints.shape}."
        )
    if fps.size != 1:
        raise ConfigError(f"{path.name}: fps must be one number, got shape {fps.shape}.")
    return np.where(np.isfinite(joints), joints, np.nan), float(fps.reshape(-1)[0])


_WANTED = ("joints", "fps")
