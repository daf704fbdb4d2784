"""Recording of an agent's episodes as a data set of Minari (https://minari.farama.org) or a folder.

Finished episodes are stored in a temporary folder beside the data set, which is renamed in a single
step at the end.
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
from hrc_env.core.infos import match_keys
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
"""Infos at the top level of a Minari data set, outside of the groups "belief" and "truth"."""
ROOT = "MINARI_DATASETS_PATH"
"""Name of Minari's environment variable for the folder of data sets."""
MOST_BYTES = 4 * 2**30
"""Maximum total size of the images of simultaneous episodes, which are held in memory until the
episodes end [bytes].
"""
Episode = dict[str, Any]
"""Arrays of an episode, by name. An episode has one more observation than actions."""


def run(request: RecordingRequest) -> int:
    """Record episodes, print the path of the data set, and return the exit status.

    Raises:
        MissingExtraError: Minari is needed but not installed.
        ConfigError: the data set exists, its name is not valid, or requested infos or images are
            not available.
    """
    minari = _import_minari() if request.folder is None else None
    if request.folder is None:
        path = _find_minari_path(minari, str(request.out))
    else:
        path = _check_free(request.folder)
    about = _describe(request)
    draft, console = get_draft_path(path), Console()
    _check_same_request(request, draft)
    make_ready(console, request.perception, draws=bool(request.observe_images))
    firsts = range(0, request.episodes, request.num_envs)
    with progress_bar(console, "recording") as say:
        for first in firsts:
            n = min(request.num_envs, request.episodes - first)
            files = [draft / format_file_name(first + b) for b in range(n)]
            if not all(file.exists() for file in files):
                for file, episode in zip(files, _play(request, first, n), strict=True):
                    _write_episode(file, episode)
            say(1 / len(firsts), "")
    files = [draft / format_file_name(k) for k in range(request.episodes)]
    n_steps = sum(_count_steps(file) for file in files)
    if minari is None:
        write_whole(draft / ABOUT, json.dumps(about, indent=1))
        os.replace(draft, path)
        how = f'hrc_env.load_episodes("{path}")'
    else:
        _write_minari(minari, request, path, draft, [read_arrays(file) for file in files])
        shutil.rmtree(draft)
        how = f'minari.load_dataset("{request.out}")'
    text = f"{len(files)} episodes, {n_steps:,} steps in {path}: {how}"
    console.print(text, markup=False, highlight=False, soft_wrap=True)
    return 0


def _count_steps(file: Path) -> int:
    with np.load(file) as arrays:
        return len(arrays["rewards"])


def _check_free(path: Path) -> Path:
    """Return the path of a folder to create; raise `ConfigError` if it already exists."""
    if path.exists():
        raise ConfigError(
            f"{path} exists already and is not extended: choose another --folder, or delete it."
        )
    return path


def format_command(request: RecordingRequest) -> str:
    """Return the command line that reproduces a recording."""
    words = ["python", "-m", "hrc_env", "record", request.task]
    for field in fields(RecordingRequest):
        value = getattr(request, field.name)
        if value == field.default or field.name == "task":
            continue
        option = f"--{field.name.replace('_', '-')}"
        several = value if isinstance(value, tuple | list) else [] if value is True else [value]
        words += [option, *map(str, several)]
    return shlex.join(words)


def _describe(request: RecordingRequest) -> dict[str, Any]:
    """Return the metadata of a data set.

    It includes the command, arguments, configuration, versions, seeds and cameras.

    Raises:
        ConfigError: the environment, or requested infos or images, are not available.
    """
    env = HRCVectorEnv(1, **request.keywords())
    try:
        _choose_parts(request, env, env.reset(seed=request.seed)[1], request.num_envs)
        first = env.shards.first
        cameras = first.scene.cameras
        slices = {name: [part.start, part.stop] for name, part in first.layout.slices.items()}
        return {
            "format": FORMAT, "command": format_command(request), "task": request.task,
            "episodes": request.episodes,
            "seeds": list(range(request.seed, request.seed + request.episodes)),
            "environment": for_json(request.keywords(), "environment"),
            "arguments": json.loads(json.dumps(asdict(request), default=str)),
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


def _import_minari() -> Any:
    try:
        import h5py  # noqa: F401  in which Minari writes
        import minari
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            f"Data sets need {error.name}, which is not installed. Install it with: pip install "
            '"hrc_env[minari]"'
        ) from error
    return minari


def _find_minari_path(minari: Any, name: str) -> Path:
    """Return the folder of a new data set; raise `ConfigError` if it exists or has a bad name."""
    from minari.dataset.minari_dataset import parse_dataset_id

    try:
        namespace, short, version = parse_dataset_id(name)
    except (ValueError, TypeError) as error:
        raise ConfigError(
            "--out must be a name of letters, digits, - and _, with optional folders, and end in a "
            f"version, such as hrc/pick-place/scripted-v0; got {name!r}."
        ) from error
    path = minari.storage.get_dataset_path(name)
    if path.exists():
        head = f"{namespace}/" if namespace else ""
        raise ConfigError(
            f"The data set {name!r} exists already ({path}) and is not extended. Choose another "
            f"name, such as {head}{short}-v{version + 1}, or delete it: minari delete {name}"
        )
    return path


def _check_same_request(request: RecordingRequest, draft: Path) -> None:
    """Create the temporary folder, or check that it was created with the same arguments."""
    record, text = draft / "asked.json", json.dumps(asdict(request), indent=1, default=str)
    if record.exists() and record.read_text() != text:
        raise ConfigError(
            f"{draft} contains episodes that were recorded with other arguments ({record}): use "
            "the same arguments, delete the folder, or choose another name with --out."
        )
    write_whole(record, text)


def _play(request: RecordingRequest, first: int, n: int) -> list[Episode]:
    """Play the episodes `first` to `first + n - 1` in parallel environments and return them."""
    env = HRCVectorEnv(n, **request.keywords())
    try:
        info, seed = env_info(env.shards.first), request.seed + first
        agent = make_agent(request.agent, info, seed, request.trust)
        observation, infos = env.reset(seed=seed)
        parts = _choose_parts(request, env, infos, n)
        steps, moments = list[Transition](), [parts.read(env, infos)]
        for step in rollout(env, _Clipped(agent), observation):
            steps.append(step)
            moments.append(parts.read(env, step.info))
        lengths = np.sum([step.is_playing for step in steps], axis=0)
        return [
            _make_episode(observation, steps[:length], moments[: length + 1], b, seed + b)
            for b, length in enumerate(lengths)
        ]
    finally:
        env.close()


def _choose_parts(
    request: RecordingRequest, env: HRCVectorEnv, info: Mapping[str, Any], n: int
) -> MomentParts:
    """Select the data to record at each step of `n` simultaneous episodes.

    Raises:
        ConfigError: an info does not exist, or the images exceed `MOST_BYTES`.
    """
    available = [name for name in info if not name.startswith("_")]
    names = dict.fromkeys((*TOP, *match_keys(request.infos, available)))
    if (images := env.shards.first.images) is not None:
        n_moments = (env.max_episode_steps + 1) * n
        n_bytes = n_moments * len(images.names) * int(np.prod(images.shape))
        if n_bytes > MOST_BYTES:
            raise ConfigError(
                f"Images of {len(images.names)} cameras, {images.shape[0]} x {images.shape[1]}, "
                f"are {n_bytes / 2**30:.1f} GiB for {n} simultaneous episodes, but at most "
                f"{MOST_BYTES / 2**30:.0f} are kept in memory: observe smaller images, fewer "
                "cameras, or use fewer parallel environments (--num-envs)."
            )
    return MomentParts(tuple(names), request.poses, request.keypoints)


class _Clipped:
    """Wrapper of an agent that clips actions to the action space, as data sets require."""

    def __init__(self, agent: Agent) -> None:
        self.agent = agent

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return the agent's actions (..., A), clipped to [-1, 1]."""
        return np.clip(self.agent.act(observation), -1, 1)


def _make_episode(
    first: Observation, steps: Sequence[Transition], moments: Sequence[Moment], b: int, seed: int
) -> Episode:
    """Assemble the arrays of the episode of environment `b`."""
    observations = [first, *(step.observation for step in steps)]
    parts = [each if isinstance(each, Mapping) else {"": each} for each in observations]
    return {
        **{f"observations/{k}": np.stack([p[k][b] for p in parts]) for k in parts[0]},
        "actions": np.stack([step.action[b] for step in steps]),
        "rewards": np.stack([step.reward[b] for step in steps]),
        "terminations": np.stack([step.terminated[b] for step in steps]),
        "truncations": np.stack([step.truncated[b] for step in steps]),
        **{name: np.stack([each[name][b] for each in moments]) for name in moments[0]},
        "seed": np.array(seed),
    }


def _write_episode(path: Path, episode: Episode) -> None:
    """Write an episode to a file; an interrupted write leaves no partial file."""
    rough = path.with_suffix(".rough.npz")
    np.savez_compressed(rough, **episode)
    os.replace(rough, path)


def _write_minari(
    minari: Any, request: RecordingRequest, path: Path, draft: Path, episodes: list[Episode]
) -> None:
    """Create the data set in the temporary folder, and move it to its final path."""
    env = gymnasium.make(request.task, **request.keywords())
    with (
        contextlib.closing(env),
        _redirect_minari(draft / "whole") as root,
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore")  # warnings of a missing author, and so on
        shutil.rmtree(root, ignore_errors=True)
        made = minari.create_dataset_from_buffers(
            request.out, [_make_buffer(k, each) for k, each in enumerate(episodes)], env=env,
            algorithm_name=request.agent, description=request.task, requirements=["hrc_env"],
        )  # fmt: skip
        about = {"hrc_env_command": format_command(request)}
        about["hrc_env_versions"] = json.dumps(provenance())
        made.storage.update_metadata(about)
    name = str(request.out)
    namespace = name.rpartition("/")[0]
    if namespace and namespace not in minari.namespace.list_local_namespaces():
        minari.namespace.create_namespace(namespace)
    os.replace(draft / "whole" / name, path)


@contextlib.contextmanager
def _redirect_minari(folder: Path) -> Iterator[Path]:
    """Redirect Minari's output to a folder within the context manager."""
    before = os.environ.get(ROOT)
    os.environ[ROOT] = str(folder)
    try:
        yield folder
    finally:
        del os.environ[ROOT]
        if before is not None:
            os.environ[ROOT] = before


def _make_buffer(k: int, episode: Episode) -> Any:
    """Return an episode in Minari's format, with belief, truth and keypoints as groups of infos."""
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
