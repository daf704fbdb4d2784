"""Episodes of an agent as a data set: of Minari (https://minari.farama.org), or a folder.

They are kept as they are finished, in a folder beside the data set, which is made of them in the
end, at once.
"""

import contextlib
import json
import os
import shlex
import shutil
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from hrc_env.core.errors import ConfigError, MissingExtraError
from hrc_env.core.infos import matching
from hrc_env.core.mapping import for_json
from hrc_env.core.progress import progress_bar
from hrc_env.core.results import provenance, write_whole
from hrc_env.evaluation.dataset import (
    ABOUT,
    FORMAT,
    format_file_name,
    get_draft_path,
    read_arrays,
    select_folder,
)
from hrc_env.evaluation.moments import Moment, MomentParts, add_folder
from hrc_env.evaluation.rollout import Transition, rollout
from hrc_env.geometry.cameras import projections
from hrc_env.pipeline.ready import make_ready
from hrc_env.vector.env import HRCVectorEnv

from .env_info import Agent, Observation, env_info
from .registry import make_agent
from .requests import RecordingRequest

TOP = ("cost", "is_success")
"""Infos that a Minari data set has outside of the groups "belief" and "truth"."""
ROOT = "MINARI_DATASETS_PATH"
"""Environment variable of Minari: where data sets are."""
MOST_BYTES = 4 * 2**30
"""Images of episodes that are played side by side, which are held in memory until they end."""
Episode = dict[str, Any]
"""Arrays by name: observations, of which there is one more than of actions, and so on."""


def run(asked: RecordingRequest) -> int:
    """Record, print the place, and return the exit status.

    Raises:
        MissingExtraError: Minari is asked for and not installed.
        ConfigError: the data set exists, cannot be called so, or infos or images are asked for
            that cannot be.
    """
    minari = _minari() if asked.folder is None else None
    path = _free_folder(asked.folder) if asked.folder else _free(minari, str(asked.out))
    about = _about(asked)
    draft, console = get_draft_path(path), Console()
    _same_as_before(asked, draft)
    make_ready(console, asked.perception, draws=bool(asked.observe_images))
    firsts = range(0, asked.episodes, asked.num_envs)
    with progress_bar(console, "recording") as say:
        for first in firsts:
            n = min(asked.num_envs, asked.episodes - first)
            files = [draft / format_file_name(first + b) for b in range(n)]
            if not all(file.exists() for file in files):
                for file, episode in zip(files, _played(asked, first, n), strict=True):
                    _keep(file, episode)
            say(1 / len(firsts), "")
    files = [draft / format_file_name(k) for k in range(asked.episodes)]
    n_steps = sum(_steps_of(file) for file in files)
    if minari is None:
        write_whole(draft / ABOUT, json.dumps(about, indent=1))
        os.replace(draft, path)
        how = f'hrc_env.load_episodes("{path}")'
    else:
        _write(minari, asked, path, draft, [read_arrays(file) for file in files])
        shutil.rmtree(draft)
        how = f'minari.load_dataset("{asked.out}")'
    said = f"{len(files)} episodes, {n_steps:,} steps in {path}: {how}"
    console.print(said, markup=False, highlight=False, soft_wrap=True)
    return 0


def _steps_of(file: Path) -> int:
    with np.load(file) as arrays:
        return len(arrays["rewards"])


def _free_folder(path: Path) -> Path:
    """The place of a data set in a folder; `ConfigError` if there is anything."""
    if path.exists():
        raise ConfigError(
            f"{path} is there already, and nothing is added to it: choose another --folder, or "
            "delete it."
        )
    return path


def command(asked: RecordingRequest) -> str:
    """The line that records so."""
    words = ["python", "-m", "hrc_env", "record", asked.task]
    for each in fields(RecordingRequest):
        value = getattr(asked, each.name)
        if value == each.default or each.name == "task":
            continue
        option = f"--{each.name.replace('_', '-')}"
        several = value if isinstance(value, tuple | list) else [] if value is True else [value]
        words += [option, *map(str, several)]
    return shlex.join(words)


def _about(asked: RecordingRequest) -> dict[str, Any]:
    """Return the metadata of a data set: command, arguments, configuration, versions, seeds,
    cameras.

    Raises:
        ConfigError: the environment, infos or images that are asked for cannot be.
    """
    env = HRCVectorEnv(1, **asked.keywords())
    try:
        _kept_of(asked, env, env.reset(seed=asked.seed)[1], asked.num_envs)
        first = env.shards.first
        cameras = first.scene.cameras
        slices = {name: [part.start, part.stop] for name, part in first.layout.slices.items()}
        return {
            "format": FORMAT, "command": command(asked), "task": asked.task,
            "episodes": asked.episodes,
            "seeds": list(range(asked.seed, asked.seed + asked.episodes)),
            "environment": for_json(asked.keywords(), "environment"),
            "arguments": json.loads(json.dumps(asdict(asked), default=str)),
            "config": json.loads(json.dumps(asdict(env.config), default=str)),
            "ctrl_dt_s": env.config.ctrl_dt, "observation": slices,
            "cameras": [
                {"name": camera.name, "P": P.tolist(), "size_px": [camera.width_px,
                 camera.height_px]}
                for camera, P in zip(cameras, projections(cameras), strict=True)
            ],
            **provenance(),
        }  # fmt: skip
    finally:
        env.close()


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


def _same_as_before(asked: RecordingRequest, draft: Path) -> None:
    """Make the draft's folder, or see that it was begun with the same arguments."""
    record, now = draft / "asked.json", json.dumps(asdict(asked), indent=1, default=str)
    if record.exists() and record.read_text() != now:
        raise ConfigError(
            f"{draft} holds episodes that were recorded with other arguments ({record}): use these "
            "again to go on, delete the folder, or choose another name with --out."
        )
    write_whole(record, now)


def _played(asked: RecordingRequest, first: int, n: int) -> list[Episode]:
    """Episodes `first` to `first + n - 1`, side by side."""
    env = HRCVectorEnv(n, **asked.keywords())
    try:
        agent = make_agent(asked.agent, env_info(env.shards.first), asked.seed + first, asked.trust)
        begun = env.reset(seed=asked.seed + first)
        kept = _kept_of(asked, env, begun[1], n)
        steps, moments = list[Transition](), [kept.read(env, begun[1])]
        for step in rollout(env, _Clipped(agent), begun[0]):
            steps.append(step)
            moments.append(kept.read(env, step.info))
        lengths = np.sum([step.is_playing for step in steps], axis=0)
        seeds = range(asked.seed + first, asked.seed + first + n)
        parts = [(steps[:length], moments[: length + 1]) for length in lengths]
        return [_episode(begun[0], *parts[b], b, seed) for b, seed in enumerate(seeds)]
    finally:
        env.close()


def _kept_of(
    asked: RecordingRequest, env: HRCVectorEnv, info: Mapping[str, Any], n: int
) -> MomentParts:
    """Return the requested parts of each moment of `n` episodes side by side, of the infos that
    there are; `ConfigError` for other infos, and for more images than memory holds."""
    there = [name for name in info if not name.startswith("_")]
    names = dict.fromkeys((*TOP, *matching(asked.infos, there)))
    if (images := env.shards.first.images) is not None:
        n_moments = (env.max_episode_steps + 1) * n
        n_bytes = n_moments * len(images.names) * int(np.prod(images.shape))
        if n_bytes > MOST_BYTES:
            raise ConfigError(
                f"Images of {len(images.names)} cameras, {images.shape[0]} x {images.shape[1]}, "
                f"are {n_bytes / 2**30:.1f} GiB for {n} episodes side by side, and at most "
                f"{MOST_BYTES / 2**30:.0f} are held in memory: observe smaller images, fewer "
                "cameras, or play fewer environments together (--num-envs)."
            )
    return MomentParts(tuple(names), asked.poses, asked.keypoints)


class _Clipped:
    """An agent whose actions are within the action space, as data sets want them."""

    def __init__(self, agent: Agent) -> None:
        self.agent = agent

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return the agent's actions, clipped."""
        return np.clip(self.agent.act(observation), -1, 1)


def _episode(
    begun: Observation, steps: Sequence[Transition], moments: Sequence[Moment], b: int, seed: int
) -> Episode:
    """Return the episode of environment `b`."""
    seen = [begun, *(step.observation for step in steps)]
    parts = [each if isinstance(each, Mapping) else {"": each} for each in seen]
    return {
        **{f"observations/{k}": np.stack([p[k][b] for p in parts]) for k in parts[0]},
        "actions": np.stack([step.action[b] for step in steps]),
        "rewards": np.stack([step.reward[b] for step in steps]),
        "terminations": np.stack([step.terminated[b] for step in steps]),
        "truncations": np.stack([step.truncated[b] for step in steps]),
        **{name: np.stack([each[name][b] for each in moments]) for name in moments[0]},
        "seed": np.array(seed),
    }


def _keep(path: Path, episode: Episode) -> None:
    """Write an episode into a file, which appears whole."""
    rough = path.with_suffix(".rough.npz")
    np.savez_compressed(rough, **episode)
    os.replace(rough, path)


def _write(
    minari: Any, asked: RecordingRequest, path: Path, draft: Path, episodes: list[Episode]
) -> None:
    """Make the data set inside the draft, then move it to its place."""
    env = gymnasium.make(asked.task, **asked.keywords())
    with contextlib.closing(env), _root(draft / "whole") as root, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that there is no author, and so on
        shutil.rmtree(root, ignore_errors=True)
        made = minari.create_dataset_from_buffers(
            asked.out, [_buffer(k, each) for k, each in enumerate(episodes)], env=env,
            algorithm_name=asked.agent, description=asked.task, requirements=["hrc_env"],
        )  # fmt: skip
        about = {"hrc_env_command": command(asked), "hrc_env_versions": json.dumps(provenance())}
        made.storage.update_metadata(about)
    name = str(asked.out)
    namespace = name.rpartition("/")[0]
    if namespace and namespace not in minari.namespace.list_local_namespaces():
        minari.namespace.create_namespace(namespace)
    os.replace(draft / "whole" / name, path)


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
    """An episode as Minari takes it; belief and other things that were kept are groups of infos."""
    from minari.data_collector import EpisodeBuffer

    seen, infos = select_folder(episode, "observations"), dict[str, Any]()
    for group in ("belief", "truth", "keypoints"):
        infos[group] = select_folder(episode, group)
    infos |= {name: episode[add_folder(name)] for name in TOP}
    for name in TOP:
        infos[add_folder(name).partition("/")[0]].pop(name)
    return EpisodeBuffer(
        id=k, seed=int(episode["seed"]), observations=seen.get("", seen),
        infos={name: value for name, value in infos.items() if len(value)},
        **{n: episode[n] for n in ("actions", "rewards", "terminations", "truncations")},
    )  # fmt: skip
