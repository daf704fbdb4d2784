"""Episodes of an agent as a data set of Minari (https://minari.farama.org).

They are kept as they are finished, in a folder beside the data set, which is made of them in the
end, at once.
"""

import contextlib
import json
import os
import shutil
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from hrc_env.cli.record import Record
from hrc_env.core.errors import ConfigError, MissingExtraError
from hrc_env.core.progress import progress_bar
from hrc_env.core.results import write_whole
from hrc_env.evaluation.rollout import Transition, rollout
from hrc_env.pipeline.ready import make_ready
from hrc_env.vector.env import HRCVectorEnv

from .env_info import Agent, Observation, env_info
from .registry import make_agent

INFOS = ("cost", "is_success")
"""What is kept of the infos."""
ROOT = "MINARI_DATASETS_PATH"
"""Environment variable of Minari: where data sets are."""
Episode = dict[str, Any]
"""Arrays by name: observations, of which there is one more than of actions, and so on."""


def run(asked: Record) -> int:
    """Record, print the place, and return the exit status.

    Raises:
        MissingExtraError: Minari is not installed.
        ConfigError: the data set exists, or cannot be called so.
    """
    minari = _minari()
    path = _free(minari, asked.out)
    draft, console = path.with_name(f".{path.name}.draft"), Console()
    _same_as_before(asked, draft)
    make_ready(console, asked.perception)
    firsts = range(0, asked.episodes, asked.num_envs)
    with progress_bar(console, "recording") as say:
        for first in firsts:
            kept, n = draft / f"{first}.npz", min(asked.num_envs, asked.episodes - first)
            if not kept.exists():
                _keep(kept, _played(asked, first, n))
            say(1 / len(firsts), "")
    episodes = [each for first in firsts for each in _kept(draft / f"{first}.npz")]
    _write(minari, asked, path, draft, episodes)
    n_steps = sum(len(each["rewards"]) for each in episodes)
    shutil.rmtree(draft)
    said = f"{len(episodes)} episodes, {n_steps:,} steps in {path}: minari.load_dataset"
    console.print(f'{said}("{asked.out}")', markup=False, highlight=False, soft_wrap=True)
    return 0


def _minari() -> Any:
    try:
        import h5py  # noqa: F401  in which Minari writes
        import minari
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            f"Data sets need {error.name}, which is not installed. Type: "
            'pip install "hrc_env[minari]"'
        ) from error
    return minari


def _free(minari: Any, name: str) -> Path:
    """Where a data set of this name will be; `ConfigError` if there is one, or cannot be."""
    from minari.dataset.minari_dataset import parse_dataset_id

    try:
        namespace, short, version = parse_dataset_id(name)
    except (ValueError, TypeError) as error:
        raise ConfigError(
            "--out must be a name of letters, digits, - and _, perhaps behind folders, and end in "
            f"a version, as hrc/pick-place/scripted-v0; got {name!r}."
        ) from error
    path = minari.storage.get_dataset_path(name)
    if path.exists():
        head = f"{namespace}/" if namespace else ""
        raise ConfigError(
            f"There is a data set {name!r} already ({path}), and nothing is added to it. Choose "
            f"another name, as {head}{short}-v{version + 1}, or delete it: minari delete {name}"
        )
    return path


def _same_as_before(asked: Record, draft: Path) -> None:
    """Make the draft's folder, or see that it was begun with the same arguments."""
    record, now = draft / "asked.json", json.dumps(asdict(asked), indent=1, default=str)
    if record.exists() and record.read_text() != now:
        raise ConfigError(
            f"{draft} holds episodes that were recorded with other arguments ({record}): use these "
            "again to go on, delete the folder, or choose another name with --out."
        )
    write_whole(record, now)


def _played(asked: Record, first: int, n: int) -> list[Episode]:
    """Episodes `first` to `first + n - 1`, side by side."""
    env = HRCVectorEnv(n, **asked.keywords())
    try:
        agent = make_agent(asked.agent, env_info(env.shards.first), asked.seed + first, asked.trust)
        begun = env.reset(seed=asked.seed + first)
        steps = list(rollout(env, _Clipped(agent), begun[0]))
        lengths = np.sum([step.is_playing for step in steps], axis=0)
        return [_episode(begun, steps[: lengths[b]], b, asked.seed + first + b) for b in range(n)]
    finally:
        env.close()


class _Clipped:
    """An agent whose actions are within the action space, as data sets want them."""

    def __init__(self, agent: Agent) -> None:
        self.agent = agent

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return the agent's actions, clipped."""
        return np.clip(self.agent.act(observation), -1, 1)


def _episode(begun: tuple[Any, Any], steps: Sequence[Transition], b: int, seed: int) -> Episode:
    """Return the episode of environment `b`."""
    seen = [begun[0], *(step.observation for step in steps)]
    infos = [begun[1], *(step.info for step in steps)]
    parts = seen if isinstance(seen[0], Mapping) else [{"": each} for each in seen]
    observations = {f"observations/{k}": np.stack([p[k][b] for p in parts]) for k in parts[0]}
    return {
        **observations,
        "actions": np.stack([step.action[b] for step in steps]),
        "rewards": np.stack([step.reward[b] for step in steps]),
        "terminations": np.stack([step.terminated[b] for step in steps]),
        "truncations": np.stack([step.truncated[b] for step in steps]),
        **{f"infos/{name}": np.stack([each[name][b] for each in infos]) for name in INFOS},
        "seed": np.array(seed),
    }


def _keep(path: Path, episodes: list[Episode]) -> None:
    """Write episodes into a file, which appears whole."""
    named = {
        f"{k}/{name}": array for k, each in enumerate(episodes) for name, array in each.items()
    }
    rough = path.with_suffix(".rough.npz")
    np.savez_compressed(rough, **named)
    os.replace(rough, path)


def _kept(path: Path) -> list[Episode]:
    """The episodes of such a file."""
    found: dict[int, Episode] = {}
    with np.load(path) as file:
        for name in file.files:
            number, _, rest = name.partition("/")
            found.setdefault(int(number), {})[rest] = file[name]
    return [found[k] for k in sorted(found)]


def _write(minari: Any, asked: Record, path: Path, draft: Path, episodes: list[Episode]) -> None:
    """Make the data set inside the draft, then move it to its place."""
    env = gymnasium.make(asked.task, **asked.keywords())
    with contextlib.closing(env), _root(draft / "whole") as root, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that there is no author, and so on
        shutil.rmtree(root, ignore_errors=True)
        minari.create_dataset_from_buffers(
            asked.out, [_buffer(k, each) for k, each in enumerate(episodes)], env=env,
            algorithm_name=asked.agent, description=asked.task, requirements=["hrc_env"],
        )  # fmt: skip
    namespace = asked.out.rpartition("/")[0]
    if namespace and namespace not in minari.namespace.list_local_namespaces():
        minari.namespace.create_namespace(namespace)
    os.replace(draft / "whole" / asked.out, path)


@contextlib.contextmanager
def _root(folder: Path) -> Iterator[Path]:
    """Meanwhile Minari writes into this folder."""
    before = os.environ.get(ROOT)
    os.environ[ROOT] = str(folder)
    try:
        yield folder
    finally:
        del os.environ[ROOT]
        if before is not None:
            os.environ[ROOT] = before


def _buffer(k: int, episode: Episode) -> Any:
    """An episode as Minari takes it."""
    from minari.data_collector import EpisodeBuffer

    within = partial(_within, episode)
    seen = within("observations")
    return EpisodeBuffer(
        id=k, seed=int(episode["seed"]), observations=seen.get("", seen), infos=within("infos"),
        **{n: episode[n] for n in ("actions", "rewards", "terminations", "truncations")},
    )  # fmt: skip


def _within(episode: Episode, folder: str) -> Episode:
    """What is called "folder/...", by the rest of the name."""
    return {k[len(folder) + 1 :]: part for k, part in episode.items() if k.startswith(f"{folder}/")}
