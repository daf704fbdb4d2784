"""Loading of Stable-Baselines3 policies without executing code from their files.

A file of `model.save` is a zip archive: `policy.pth` holds the weights, and `data` is JSON, in
which values that JSON cannot represent are stored as a pickle and a text description. Loading a
pickle can run arbitrary code of its author; loading weights cannot. The network of the weights is
rebuilt here: from the text description if its classes belong to Stable-Baselines3 or to this
package, otherwise from the pickle, which requires `trust`.
"""

import base64
import io
import json
import pickle
import re
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hrc_env.control import CONTROLS
from hrc_env.core.brought import describe
from hrc_env.core.errors import CheckpointError, learner
from hrc_env.observations import FLAT
from hrc_env.tasks.goal import ACHIEVED, DESIRED

from .env_info import EnvInfo, Observation

with learner():
    import torch
    from stable_baselines3.common.policies import BasePolicy
    from stable_baselines3.common.vec_env import VecNormalize

TRUST = "If you trust its author, use --trust (in Python, trust=True)."
PICKLED = ":serialized:"
"""Key of the base64-encoded pickle of a value that JSON cannot represent."""
POLICIES = {
    "stable_baselines3.common.policies": (
        "ActorCriticPolicy", "ActorCriticCnnPolicy", "MultiInputActorCriticPolicy",
    ),
    "stable_baselines3.sac.policies": ("SACPolicy", "CnnPolicy", "MultiInputPolicy"),
    "stable_baselines3.td3.policies": ("TD3Policy", "CnnPolicy", "MultiInputPolicy"),
}  # fmt: skip
"""Policy classes that can be rebuilt without unpickling, by module.

They are the policies of PPO and A2C, of SAC, and of TD3 and DDPG.
"""
EXTRACTORS = {
    f"{module}.{name}"
    for module, names in {
        "stable_baselines3.common.torch_layers": (
            "FlattenExtractor", "NatureCNN", "CombinedExtractor",
        ),
        "hrc_env.agents.features": ("NearAndFar",),
    }.items()
    for name in names
}  # fmt: skip
"""Feature extractors that can be rebuilt without unpickling."""
ACTIVATIONS = tuple(
    f"torch.nn.modules.activation.{name}"
    for name in ("Tanh", "ReLU", "ELU", "LeakyReLU", "SiLU", "GELU", "Mish", "Sigmoid")
)
NOT_FOR_ACTING = ("optimizer_class", "optimizer_kwargs")
"""Names of a policy's arguments that only training needs."""
CLASS = re.compile(r"<class '([\w.]+)'>")
BOX = re.compile(r"'([^']+)': Box\(.*?, \(([\d, ]*)\), \w+\)", re.S)


def load(path: Path, env_info: EnvInfo, trust: bool = False) -> "SB3Agent":
    """Load the policy from a file of Stable-Baselines3 for acting.

    Args:
        path: file that `model.save` wrote.
        env_info: information about the environment in which the policy acts.
        trust: whether pickles, which can run arbitrary code, may be loaded if a custom policy or
            network, or observation-normalization statistics, require it.

    Raises:
        CheckpointError: the file does not exist, has other spaces, or needs `trust`.
    """
    data, weights = _read(path)
    shapes = _parse_shapes(data.get("observation_space")) or {}
    env_spaces = make_spaces(env_info, [name for name in env_info.images if name in shapes])
    _check_spaces(path, data, env_spaces, env_info)
    if (control := _parse_control(data)) is not None:
        check_control(path, control, env_info)
    maker = _find_maker(path, data, trust)
    observations, actions = env_spaces
    with torch.random.fork_rng(devices=[]):  # initial weights are sampled, then replaced
        policy = _build(
            path,
            lambda: maker.make(observations, actions, lambda _: 0.0, **maker.keywords),
            weights,
        )
    return SB3Agent(policy, _load_statistics(path, trust))


def read_control(path: Path) -> str | None:
    """Return the `control` with which a policy was trained, or None if it is unknown.

    Raises:
        CheckpointError: the file was not saved by Stable-Baselines3.
    """
    return _parse_control(_read(path).data)


def check_control(path: Path, control: str, env_info: EnvInfo) -> None:
    """Raise `CheckpointError` if a policy was trained with another `control`."""
    if control != env_info.control:
        raise CheckpointError(
            f"{path} uses control={control!r}, but this environment has "
            f"control={env_info.control!r}: create it with the former (--control {control})."
        )


def _parse_control(data: Mapping[str, Any]) -> str | None:
    """Return the attribute `control` of the action space (`hrc_env.env.spaces`), or None."""
    space = data.get("action_space")
    control = space.get("control") if isinstance(space, dict) else None
    return control if control in CONTROLS else None


def check_is_one(path: Path) -> None:
    """Raise `CheckpointError` if a file was not saved by Stable-Baselines3."""
    _read(path)


class Spaces(NamedTuple):
    """Observation and action space of an environment."""

    observations: spaces.Space[Any]
    actions: spaces.Box


def make_spaces(env_info: EnvInfo, images: Sequence[str] = ()) -> Spaces:
    """Return the spaces of an environment's observations and actions.

    Args:
        env_info: information about the environment.
        images: names of the images that a policy uses; channels come first, as in
            Stable-Baselines3.
    """
    layout, size = env_info.layout, env_info.goal_size
    flat = spaces.Box(layout.low, layout.high, dtype=np.float32)
    actions = spaces.Box(-1.0, 1.0, (env_info.n_actions,), np.float32)
    beside = {}
    for name in images:
        height, width, channels = env_info.images[name]
        beside[name] = spaces.Box(0, 255, (channels, height, width), np.uint8)
    if size:
        goals = spaces.Box(-np.inf, np.inf, (size,), np.float32)
        beside |= {ACHIEVED: goals, DESIRED: goals}
    return Spaces(spaces.Dict({**beside, FLAT: flat}) if beside else flat, actions)


@dataclass(frozen=True, slots=True)
class Statistics:
    """Statistics with which `VecNormalize` normalizes observations."""

    wrapper: VecNormalize

    def apply(self, observation: Observation) -> Any:
        """Normalize an observation as in training."""
        return self.wrapper.normalize_obs(observation)  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class SB3Agent:
    """An agent that takes the mean action of a policy of Stable-Baselines3."""

    policy: BasePolicy
    """The policy, in evaluation mode on the CPU."""
    statistics: Statistics | None = None
    """Statistics for the normalization of observations, or None if they are not normalized."""

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return deterministic actions (..., A), bitwise identical to those of `model.predict`.

        Parts of an observation that were not used in training are ignored.
        """
        if isinstance(observation, Mapping):
            space = self.policy.observation_space
            names = space.spaces if isinstance(space, spaces.Dict) else ()
            observation = {name: observation[name] for name in names} or observation[FLAT]
        if self.statistics is not None:
            observation = self.statistics.apply(observation)
        return self.policy.predict(observation, deterministic=True)[0]  # type: ignore[arg-type]


class PolicyFile(NamedTuple):
    """The contents of a file of Stable-Baselines3."""

    data: Mapping[str, Any]
    """Description of the learner, parsed from the JSON in the file."""
    weights: Mapping[str, torch.Tensor]
    """Weights of the policy's network, by name."""


def _read(path: Path) -> PolicyFile:
    """Read the description and the weights from a file without unpickling."""
    if not path.exists():
        raise CheckpointError(f"No checkpoint at {path}. Train one: python -m hrc_env train")
    try:
        with zipfile.ZipFile(path) as archive:
            data, content = json.loads(archive.read("data")), archive.read("policy.pth")
    except (zipfile.BadZipFile, KeyError, ValueError) as error:
        raise CheckpointError(
            f"{path} is neither a checkpoint of hrc_env nor a policy saved by Stable-Baselines3 "
            f"({error}). Expected a file of python -m hrc_env train or model.save (.zip)."
        ) from error
    if not isinstance(data, dict):
        raise CheckpointError(f"{path} is not a policy saved by Stable-Baselines3.")
    try:
        weights = torch.load(io.BytesIO(content), map_location="cpu", weights_only=True)
    except (pickle.UnpicklingError, RuntimeError, EOFError, ValueError) as error:
        first = str(error).splitlines()[0]
        raise CheckpointError(
            f"policy.pth in {path} contains no weights, or other objects besides weights "
            f"({first}), and is not loaded: Stable-Baselines3 stores a dictionary of tensors by "
            "name."
        ) from error
    if not (
        isinstance(weights, dict) and all(isinstance(w, torch.Tensor) for w in weights.values())
    ):
        raise CheckpointError(f"policy.pth in {path} must contain tensors by name.")
    return PolicyFile(data, weights)


# Spaces


Shapes = dict[str, tuple[int, ...]]
"""Shapes of the parts of a space, by name; the name is "" for a space without parts."""


def _check_spaces(
    path: Path, data: Mapping[str, Any], env_spaces: Spaces, env_info: EnvInfo
) -> None:
    """Raise `CheckpointError` if a policy's spaces are not those of the environment."""
    advice = (
        f"Create the environment as in training (here {env_info.task}, "
        f"control={env_info.control!r}: task, control, robot, n_workers and observe_images "
        "decide), or wrap it in your own agent (MODULE:FUNCTION)."
    )
    for name, space in (("observation", env_spaces.observations), ("action", env_spaces.actions)):
        saved: Any = data.get(f"{name}_space")
        kind = CLASS.search(str(saved.get(":type:"))) if isinstance(saved, dict) else None
        if kind is None:
            raise CheckpointError(f"{path} does not describe the {name}s of its policy.")
        expected, found = _list_shapes(space), _parse_shapes(saved)
        if found is None:
            text = kind[1].rpartition(".")[2]
        elif found != expected:
            text = _describe_shapes(found)
        else:
            continue
        raise CheckpointError(
            f"{path} is for {name}s of {text}, but this environment has "
            f"{_describe_shapes(expected)}. {advice}"
        )
    for end, bound in (("low", -1.0), ("high", 1.0)):
        values = _parse_numbers(data["action_space"].get(end))
        if values.size and not np.allclose(values, bound):
            raise CheckpointError(
                f"{path} has different action bounds: its action space has {end} "
                f"{data['action_space'][end]}, here it is {bound:g}. {advice}"
            )


def _list_shapes(space: spaces.Space[Any]) -> Shapes:
    if isinstance(space, spaces.Dict):
        return {name: tuple(part.shape or ()) for name, part in space.items()}
    return {"": tuple(space.shape or ())}


def _parse_shapes(space: Any) -> Shapes | None:
    """Return the shapes of a Box or Dict from its text description, or None for other spaces."""
    if not isinstance(space, dict) or ":type:" not in space:
        return None
    if ".box.Box'" in str(space[":type:"]):
        return {"": tuple(map(int, space.get("_shape") or ()))}
    if ".dict.Dict'" in str(space[":type:"]):
        found = BOX.findall(str(space.get("spaces")))
        return {name: tuple(map(int, re.findall(r"\d+", shape))) for name, shape in found}
    return None


def _parse_numbers(text: Any) -> NDArray[np.float64]:
    """Parse the numbers in the text of an array; without a text, return an empty array."""
    return np.array(re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", str(text or "")), float)


def _describe_shapes(shapes: Shapes) -> str:
    def describe(shape: tuple[int, ...]) -> str:
        return " x ".join(map(str, shape)) + " numbers" if shape else "no numbers"

    if set(shapes) == {""}:
        return describe(shapes[""])
    parts = (f"{name!r}: {describe(shape)}" for name, shape in shapes.items())
    return "; ".join(parts) or "no parts"


# Architecture


class PolicyMaker(NamedTuple):
    """A function that creates a policy, and its arguments other than the spaces."""

    make: Callable[..., BasePolicy]
    keywords: dict[str, Any]


def _find_maker(path: Path, data: Mapping[str, Any], trust: bool) -> PolicyMaker:
    """Return the function that creates the policy of a file, and its arguments."""
    kind, saved = data.get("policy_class"), data.get("policy_kwargs", {})
    if not isinstance(kind, dict) or not isinstance(saved, dict):
        raise CheckpointError(f"{path} does not describe its policy.")
    make, unread = _find_policy_class(kind), list[str]()
    if make is None:
        unread.append(f"its policy ({kind.get('__module__', 'unknown')})")
    keywords, strange = _split_keywords(saved)
    unread += [f"{name} ({value})" for name, value in strange.items()]
    if unread and not trust:
        raise CheckpointError(
            f"{path} can only be loaded with its pickle: {', '.join(unread)} is not part of "
            f"Stable-Baselines3. A pickle can execute arbitrary code. {TRUST}"
        )
    if make is None:
        make = _unpickle(path, "policy_class", kind, type)
    if strange:
        values = _unpickle(path, "policy_kwargs", saved, dict)
        keywords = {name: value for name, value in values.items() if name not in NOT_FOR_ACTING}
    if data.get("use_sde") is True:
        keywords = {"use_sde": True, **keywords}
    return PolicyMaker(make, keywords)


def _find_policy_class(kind: Mapping[str, Any]) -> Callable[..., BasePolicy] | None:
    """Return the class in `POLICIES` that matches a description, or None if there is none."""
    module = str(kind.get("__module__"))
    found = re.match(r"<function (\w+)\.__init__ ", str(kind.get("__init__")))
    if found is None or found[1] not in POLICIES.get(module, ()):
        return None
    return getattr(import_module(module), found[1])


class PolicyKeywords(NamedTuple):
    """Arguments of a policy, separated into plain values and pickles."""

    plain: dict[str, Any]
    """Arguments that can be read without unpickling, by name."""
    strange: dict[str, str]
    """Text descriptions of the arguments that need unpickling, by name."""


def _split_keywords(saved: Mapping[str, Any]) -> PolicyKeywords:
    """Separate a policy's arguments into plain values and those that need unpickling."""
    given = {name: value for name, value in saved.items() if name not in NOT_FOR_ACTING}
    is_whole = PICKLED not in saved  # then all values are JSON
    plain, strange = dict[str, Any](), dict[str, str]()
    for name, value in given.items():
        if name.startswith(":"):
            continue
        found = CLASS.fullmatch(value) if isinstance(value, str) else None
        if found and found[1] in (*ACTIVATIONS, *EXTRACTORS):
            module, _, of = found[1].rpartition(".")
            plain[name] = getattr(import_module(module), of)
        elif isinstance(value, str) and not is_whole:
            strange[name] = value
        else:
            plain[name] = value
    return PolicyKeywords(plain, strange)


def _unpickle(path: Path, name: str, saved: Mapping[str, Any], expected: type) -> Any:
    import cloudpickle

    try:
        found = cloudpickle.loads(base64.b64decode(saved[PICKLED]))
    except Exception as error:  # custom objects can raise any exception
        raise CheckpointError(
            f"The {name} of {path} cannot be unpickled here ({type(error).__name__}: {error}). Its "
            "classes must be importable."
        ) from error
    if not isinstance(found, expected):
        raise CheckpointError(
            f"The {name} of {path} must be a {expected.__name__}, got {describe(found)}."
        )
    return found


def _build(
    path: Path, make: Callable[[], BasePolicy], weights: Mapping[str, torch.Tensor]
) -> BasePolicy:
    try:
        policy = make().to("cpu")
        policy.load_state_dict(weights)
    except Exception as error:  # a constructor with arguments from a file can raise anything
        first = " ".join(str(error).split())[:300]
        raise CheckpointError(
            f"The weights in {path} do not match the policy that it describes ({first})."
        ) from error
    policy.set_training_mode(False)
    return policy


# Normalized observations


def find_statistics(path: Path) -> Path | None:
    """Return the `VecNormalize` file that belongs to a policy's file, or None if there is none.

    The file's name is one of those used by Stable-Baselines3's `CheckpointCallback` and RL
    Baselines3 Zoo: vecnormalize.pkl, NAME_vecnormalize.pkl, NAME_vecnormalize_1000_steps.pkl.
    """
    steps = re.sub(r"_(\d+_steps)$", r"_vecnormalize_\1", path.stem)
    names = (f"{path.stem}_vecnormalize.pkl", f"{steps}.pkl", "vecnormalize.pkl")
    return next((file for name in names if (file := path.with_name(name)).is_file()), None)


def _load_statistics(path: Path, trust: bool) -> Statistics | None:
    file = find_statistics(path)
    if file is None:
        return None
    if not trust:
        raise CheckpointError(
            f"{file} beside {path.name} contains the statistics with which VecNormalize scaled "
            f"observations or rewards. It is a pickle, which can execute arbitrary code. {TRUST} "
            "If observations were not scaled, move that file away."
        )
    try:
        wrapper = pickle.loads(file.read_bytes())
    except Exception as error:
        raise CheckpointError(f"{file} cannot be unpickled ({error}).") from error
    if not isinstance(wrapper, VecNormalize):
        raise CheckpointError(
            f"{file} must contain the statistics of a VecNormalize, got {type(wrapper).__name__}."
        )
    wrapper.training = False
    return Statistics(wrapper) if wrapper.norm_obs else None
