"""Data sets of episodes in a folder: a file of arrays for each episode, and metadata.

`dataset.json` holds versions, command, arguments, configuration and cameras; `episode_00000.npz`
and so on hold the arrays, with belief and truth under names of their own ("belief/...",
"truth/..."). `load_episodes` reads them back; `numpy.load` and `json.load` do, too.
"""

import json
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError, HRCError, whole
from hrc_env.core.records import Keypoints
from hrc_env.evaluation.moments import PROJECTIONS

ABOUT = "dataset.json"
"""The file of a folder's metadata."""
FORMAT = 1
"""Version of the folder's form."""
Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class Episode:
    """One recorded episode of T steps: T + 1 moments, of which the first is the reset's.

    `belief` is the robot's, `truth` the world's: an agent that learns from `truth` uses information
    that no robot has. Positions are in the world [m].
    """

    seed: int
    """The episode begins with `reset(seed=seed)`."""
    observations: NDArray[np.float32] | dict[str, NDArray[Any]]
    """(T + 1, n), or arrays by name where goals or images stand apart: "image_<camera>" is
    (T + 1, H, W, 3) of uint8."""
    actions: NDArray[np.float32]
    """(T, A) in [-1, 1]."""
    rewards: NDArray[np.float64]
    """(T,)."""
    terminations: NDArray[np.bool_]
    """(T,) whether the step ended the episode."""
    truncations: NDArray[np.bool_]
    """(T,) whether the time limit did."""
    belief: Arrays
    """(T + 1, ...) infos of the belief by name ("reward/proximity", "perception/..."). With poses
    "joints_world" (T + 1, W, J, 3) [m], "joints_cov_world" (T + 1, W, J, 3, 3) [m^2],
    "joints_velocity_world" [m/s], "age_s", "tracked" and "unknown"."""
    truth: Arrays
    """(T + 1, ...) infos of the truth by name ("cost" [control steps], "safety/...", "is_success").
    With poses "joints_world" (T + 1, W, J, 3) [m] and "present" (T + 1, W); who is not there has
    NaN."""
    keypoints: Keypoints | None = None
    """(T + 1, C, W, J) as the estimator was given them, pixels of the projections `P`; None: they
    were not recorded."""
    P: NDArray[np.float64] | None = None
    """(C, 3, 4) projections of this episode's cameras, from the world [m] to pixels, beside
    keypoints where rigs are drawn; NaN of one that did not hang. None: those of
    `metadata["cameras"]`."""

    def __len__(self) -> int:
        """Return the number of steps T."""
        return len(self.rewards)


class EpisodeSet(Sequence[Episode]):
    """The episodes of a folder, each read when it is asked for.

    Args:
        path: of the folder.
        metadata: what `dataset.json` holds: "command", "arguments", "environment" (arguments of
            `gymnasium.make`), "config", "versions" and other provenance, "seeds", "ctrl_dt_s",
            "cameras" with their projections from the world [m] to pixels, and "episodes".
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
            raise IndexError(f"There are {n} episodes in {self.path}, got number {k}.")
        return _episode(read_arrays(self.path / name_of(whole("number", k, -n, n - 1) % n)))

    def __iter__(self) -> Iterator[Episode]:
        return (self[k] for k in range(len(self)))

    def __repr__(self) -> str:
        return f"EpisodeSet({str(self.path)!r}, {len(self)} episodes)"


def load_episodes(path: str | Path) -> EpisodeSet:
    """Return the episodes that `python -m hrc_env record --folder PATH` has recorded.

    Args:
        path: of the folder.

    Raises:
        ConfigError: there is no such folder, it holds no data set, or one of a newer form.
    """
    folder = Path(path)
    about = folder / ABOUT
    if not about.is_file():
        draft = draft_of(folder)
        hint = (
            f"Its recording was stopped: the same command goes on with {draft}."
            if draft.exists()
            else "python -m hrc_env record --folder makes one; minari.load_dataset(NAME) loads "
            "what record --out has made."
        )
        raise ConfigError(f"{folder} is no folder of recorded episodes: {ABOUT} is missing. {hint}")
    try:
        metadata = json.loads(about.read_text())
        form = int(metadata["format"])
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{about} cannot be read: {type(error).__name__} {error}.") from error
    if form > FORMAT:
        raise ConfigError(
            f"{about} is of form {form}, this version reads up to {FORMAT}: install the version of "
            f"hrc_env that recorded it ({metadata.get('hrc_env')})."
        )
    return EpisodeSet(folder, metadata)


def draft_of(path: Path) -> Path:
    """Return the folder in which a data set grows until it is whole."""
    return path.with_name(f".{path.name}.draft")


def name_of(k: int) -> str:
    """Return the name of an episode's file."""
    return f"episode_{k:05d}.npz"


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of an episode's file; `HRCError` if it cannot be read."""
    try:
        with np.load(path) as file:
            return {name: file[name] for name in file.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise HRCError(f"{path} cannot be read ({error}): record the data set anew.") from error


def within(arrays: Arrays, folder: str) -> dict[str, NDArray[Any]]:
    """Return the arrays called "folder/...", by the rest of the name."""
    return {k[len(folder) + 1 :]: v for k, v in arrays.items() if k.startswith(f"{folder}/")}


def _episode(arrays: Arrays) -> Episode:
    seen, found = within(arrays, "observations"), within(arrays, "keypoints")
    names = ("actions", "rewards", "terminations", "truncations")
    projections = found.pop(PROJECTIONS, None)
    return Episode(
        seed=int(arrays["seed"]), observations=seen.get("", seen),
        **{name: arrays[name] for name in names},
        belief=within(arrays, "belief"), truth=within(arrays, "truth"),
        keypoints=Keypoints(**found) if found else None,
        P=None if projections is None else projections[0],
    )  # fmt: skip
