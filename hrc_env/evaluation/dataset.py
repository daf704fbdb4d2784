"""Data sets of episodes in a folder, with one file of arrays per episode and a metadata file.

`dataset.json` contains versions, command, arguments, configuration and cameras. `episode_00000.npz`
and the following files contain the arrays. The names of arrays that belong to the belief or the
truth begin with "belief/" or "truth/". `load_episodes` reads a folder; its files can also be read
with `numpy.load` and `json.load`.
"""

import json
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError, HRCError, check_integer
from hrc_env.core.records import Keypoints
from hrc_env.evaluation.moments import PROJECTIONS

ABOUT = "dataset.json"
"""Name of the metadata file in a folder."""
FORMAT = 1
"""Version of the folder's format."""
Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class Episode:
    """One recorded episode of T steps and T + 1 moments, the first of which is the reset.

    `belief` is the robot's estimate, and `truth` the simulator's state: an agent that learns from
    `truth` uses information that is not available to a real robot. Positions are in the world frame
    [m].
    """

    seed: int
    """Seed with which the episode begins, as in `reset(seed=seed)`."""
    observations: NDArray[np.float32] | dict[str, NDArray[Any]]
    """Observations (T + 1, n), or a dictionary of arrays if goals or images are separate. Its array
    "image_<camera>" has the shape (T + 1, H, W, 3) and the type uint8."""
    actions: NDArray[np.float32]
    """Actions (T, A) in [-1, 1]."""
    rewards: NDArray[np.float64]
    """Rewards (T,)."""
    terminations: NDArray[np.bool_]
    """Mask (T,) of the step that ends the episode by termination."""
    truncations: NDArray[np.bool_]
    """Mask (T,) of the step that ends the episode by the time limit."""
    belief: Arrays
    """Infos (T + 1, ...) computed from the belief, by name, such as "reward/proximity" and
    "perception/...". If poses are recorded, it also contains "joints_world" (T + 1, W, J, 3) [m],
    "joints_cov_world" (T + 1, W, J, 3, 3) [m^2], "joints_velocity_world" [m/s], "age_s", "tracked"
    and "unknown"."""
    truth: Arrays
    """Infos (T + 1, ...) computed from the ground truth, by name, such as "cost" [control steps],
    "safety/..." and "is_success". If poses are recorded, it also contains "joints_world"
    (T + 1, W, J, 3) [m], which is NaN for absent workers, and the mask "present" (T + 1, W)."""
    keypoints: Keypoints | None = None
    """Keypoints (T + 1, C, W, J) that the estimator received [px], in the image coordinates of the
    projections `P`; None if they were not recorded."""
    P: NDArray[np.float64] | None = None
    """Projection matrices (C, 3, 4) of this episode's cameras, from the world frame [m] to pixels;
    NaN for missing cameras. They are given if keypoints are recorded and the rig is sampled in
    every episode. If None, `metadata["cameras"]` contains the projections for all episodes."""

    def __len__(self) -> int:
        """Return the number of steps T."""
        return len(self.rewards)


class EpisodeSet(Sequence[Episode]):
    """The episodes of a folder. An episode is read from its file when it is indexed.

    Args:
        path: the folder.
        metadata: the contents of `dataset.json`: "command", "arguments", "environment" (arguments
            of `gymnasium.make`), "config", "versions" and other provenance, "seeds", "ctrl_dt_s",
            "cameras" with their projections from the world frame [m] to pixels, and "episodes".
    """

    def __init__(self, path: Path, metadata: Mapping[str, Any]) -> None:
        self.path, self.metadata = path, metadata

    def __len__(self) -> int:
        return int(self.metadata["episodes"])

    def __getitem__(self, k: Any) -> Any:
        if isinstance(k, slice):
            return [self[j] for j in range(*k.indices(len(self)))]
        n = len(self)
        if isinstance(k, int | np.integer) and not -n <= k < n:  # ends a loop over the set
            raise IndexError(f"{self.path} has {n} episodes, got index {k}.")
        return _make_episode(
            read_arrays(self.path / format_file_name(check_integer("number", k, -n, n - 1) % n))
        )

    def __iter__(self) -> Iterator[Episode]:
        return (self[k] for k in range(len(self)))

    def __repr__(self) -> str:
        return f"EpisodeSet({str(self.path)!r}, {len(self)} episodes)"


def load_episodes(path: str | Path) -> EpisodeSet:
    """Return the episodes recorded by `python -m hrc_env record --folder PATH`.

    Args:
        path: the folder.

    Raises:
        ConfigError: the folder does not exist, or it holds no data set or one of a newer format.
    """
    folder = Path(path)
    about = folder / ABOUT
    if not about.is_file():
        draft = get_draft_path(folder)
        hint = (
            f"Its recording was interrupted: the same command continues it from {draft}."
            if draft.exists()
            else "python -m hrc_env record --folder creates one; minari.load_dataset(NAME) loads "
            "data sets of record --out."
        )
        raise ConfigError(
            f"{folder} is not a folder of recorded episodes: {ABOUT} is missing. {hint}"
        )
    try:
        metadata = json.loads(about.read_text())
        form = int(metadata["format"])
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{about} cannot be read: {type(error).__name__} {error}.") from error
    if form > FORMAT:
        raise ConfigError(
            f"{about} has format {form}, but this version reads formats up to {FORMAT}: install "
            f"the version of hrc_env that recorded it ({metadata.get('hrc_env')})."
        )
    return EpisodeSet(folder, metadata)


def get_draft_path(path: Path) -> Path:
    """Return the folder in which a data set is recorded until it is complete."""
    return path.with_name(f".{path.name}.draft")


def format_file_name(k: int) -> str:
    """Return the file name of the k-th episode."""
    return f"episode_{k:05d}.npz"


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of an episode's file; raise `HRCError` if it cannot be read."""
    try:
        with np.load(path) as file:
            return {name: file[name] for name in file.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise HRCError(f"{path} cannot be read ({error}): record the data set again.") from error


def select_folder(arrays: Arrays, folder: str) -> dict[str, NDArray[Any]]:
    """Return the arrays with names "folder/NAME", by NAME."""
    return {k[len(folder) + 1 :]: v for k, v in arrays.items() if k.startswith(f"{folder}/")}


def _make_episode(arrays: Arrays) -> Episode:
    observations = select_folder(arrays, "observations")
    keypoints = select_folder(arrays, "keypoints")
    names = ("actions", "rewards", "terminations", "truncations")
    projections = keypoints.pop(PROJECTIONS, None)
    return Episode(
        seed=int(arrays["seed"]), observations=observations.get("", observations),
        **{name: arrays[name] for name in names},
        belief=select_folder(arrays, "belief"), truth=select_folder(arrays, "truth"),
        keypoints=Keypoints(**keypoints) if keypoints else None,
        P=None if projections is None else projections[0],
    )  # fmt: skip
