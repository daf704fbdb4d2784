"""Policies of Stable-Baselines3, read from their files without running anything that files hold.

What `model.save` writes is a zip: `policy.pth` holds the weights, and `data` is JSON in which all
that JSON cannot hold is a pickle, beside what of it could be written plainly. Reading a pickle runs
whatever its author put there. The weights alone do not, and the network round them is built here:
from the plain part where it is one of Stable-Baselines3 or of this package, otherwise from the
pickle, which wants `trust`.
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
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hrc_env.control import CONTROLS
from hrc_env.core.brought import described
from hrc_env.core.errors import CheckpointError, learner
from hrc_env.observations import FLAT
from hrc_env.tasks.goal import ACHIEVED, DESIRED

from .env_info import EnvInfo, Observation

with learner():
    import torch
    from stable_baselines3.common.policies import BasePolicy
    from stable_baselines3.common.vec_env import VecNormalize

TRUST = "If you trust who made it: --trust, in Python trust=True."
PICKLED = ":serialized:"
"""Key of a value that JSON cannot hold, as base64 of a pickle."""
POLICIES = {
    "stable_baselines3.common.policies": (
        "ActorCriticPolicy", "ActorCriticCnnPolicy", "MultiInputActorCriticPolicy",
    ),
    "stable_baselines3.sac.policies": ("SACPolicy", "CnnPolicy", "MultiInputPolicy"),
    "stable_baselines3.td3.policies": ("TD3Policy", "CnnPolicy", "MultiInputPolicy"),
}  # fmt: skip
"""Policies that are built without a pickle, by module: those of PPO and A2C, of SAC, of TD3 and
DDPG."""
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
"""Extractors of features that are known without a pickle."""
ACTIVATIONS = tuple(
    f"torch.nn.modules.activation.{name}"
    for name in ("Tanh", "ReLU", "ELU", "LeakyReLU", "SiLU", "GELU", "Mish", "Sigmoid")
)
NOT_FOR_ACTING = ("optimizer_class", "optimizer_kwargs")
"""Arguments of a policy that only learning needs."""
CLASS = re.compile(r"<class '([\w.]+)'>")
BOX = re.compile(r"'([^']+)': Box\(.*?, \(([\d, ]*)\), \w+\)", re.S)


def load(path: Path, env_info: EnvInfo, trust: bool = False) -> "SB3Agent":
    """Return the policy of a file of Stable-Baselines3, for acting.

    Args:
        path: what `model.save` has written.
        env_info: of the environment that it acts in.
        trust: whether pickles are read where nothing else will do: a policy, a network or
            statistics of observations of the user's own. That runs code of whoever made the file.

    Raises:
        CheckpointError: no such file, other spaces, or something that wants `trust`.
    """
    data, weights = _read(path)
    said = _shapes_said(data.get("observation_space")) or {}
    seen, actions = spaces_of(env_info, [name for name in env_info.images if name in said])
    _check_spaces(path, data, seen, actions, env_info)
    if (control := _control_said(data)) is not None:
        check_control(path, control, env_info)
    make, keywords = _architecture(path, data, trust)
    with torch.random.fork_rng(devices=[]):  # the first weights are drawn, and replaced
        policy = _built(path, lambda: make(seen, actions, lambda _: 0.0, **keywords), weights)
    return SB3Agent(policy, _statistics(path, trust))


def control_of(path: Path) -> str | None:
    """Return the `control` of the environment in which the policy of a file learnt; None if the
    file does not hold it. `CheckpointError` unless Stable-Baselines3 has written it."""
    return _control_said(_read(path)[0])


def check_control(path: Path, control: str, env_info: EnvInfo) -> None:
    """Raise `CheckpointError` for a policy that learnt with another `control`."""
    if control != env_info.control:
        raise CheckpointError(
            f"{path} acts by control={control!r}, and this environment has control="
            f"{env_info.control!r}: make it with the former (--control {control})."
        )


def _control_said(data: Mapping[str, Any]) -> str | None:
    """Return the attribute `control` of the space of actions (`hrc_env.env.spaces`)."""
    said = data.get("action_space")
    control = said.get("control") if isinstance(said, dict) else None
    return control if control in CONTROLS else None


def check_is_one(path: Path) -> None:
    """Raise `CheckpointError` unless a file is one that Stable-Baselines3 has written."""
    _read(path)


def spaces_of(
    env_info: EnvInfo, images: Sequence[str] = ()
) -> tuple[spaces.Space[Any], spaces.Box]:
    """Return the spaces of an environment's observations and actions.

    Args:
        env_info: of the environment.
        images: names of those that a policy looks at. Their channels come first, as
            Stable-Baselines3 turns them.
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
    return (spaces.Dict({**beside, FLAT: flat}) if beside else flat), actions


@dataclass(frozen=True, slots=True)
class Statistics:
    """Statistics by which `VecNormalize` scales observations."""

    wrapper: VecNormalize

    def applied(self, observation: Observation) -> Any:
        """Return an observation as the policy saw it when it learnt."""
        return self.wrapper.normalize_obs(observation)  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class SB3Agent:
    """The mean action of a policy of Stable-Baselines3."""

    policy: BasePolicy
    statistics: Statistics | None = None
    """None: it sees observations as they are."""

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Deterministic actions (..., A), to the bit those of `model.predict`; of an observation
        with more parts it is given those that it learnt from."""
        if isinstance(observation, Mapping):
            space = self.policy.observation_space
            names = space.spaces if isinstance(space, spaces.Dict) else ()
            observation = {name: observation[name] for name in names} or observation[FLAT]
        if self.statistics is not None:
            observation = self.statistics.applied(observation)
        return self.policy.predict(observation, deterministic=True)[0]  # type: ignore[arg-type]


def _read(path: Path) -> tuple[Mapping[str, Any], Mapping[str, torch.Tensor]]:
    """Return the description and the weights of the policy in a file; neither is unpickled."""
    if not path.exists():
        raise CheckpointError(f"No checkpoint at {path}. Train one: python -m hrc_env train")
    try:
        with zipfile.ZipFile(path) as archive:
            data, content = json.loads(archive.read("data")), archive.read("policy.pth")
    except (zipfile.BadZipFile, KeyError, ValueError) as error:
        raise CheckpointError(
            f"{path} is not a checkpoint of hrc_env, nor a policy that Stable-Baselines3 saved "
            f"({error}). Expected is what python -m hrc_env train or model.save writes (.zip)."
        ) from error
    if not isinstance(data, dict):
        raise CheckpointError(f"{path} is not a policy that Stable-Baselines3 saved.")
    try:
        weights = torch.load(io.BytesIO(content), map_location="cpu", weights_only=True)
    except (pickle.UnpicklingError, RuntimeError, EOFError, ValueError) as error:
        first = str(error).splitlines()[0]
        raise CheckpointError(
            f"policy.pth in {path} holds no weights, or more than weights ({first}), and is not "
            "read: Stable-Baselines3 writes tensors by name."
        ) from error
    if not (
        isinstance(weights, dict) and all(isinstance(w, torch.Tensor) for w in weights.values())
    ):
        raise CheckpointError(f"policy.pth in {path} must hold tensors by name.")
    return data, weights


# Spaces


Shapes = dict[str, tuple[int, ...]]
"""Of the parts of a space by name; "" of one without parts."""


def _check_spaces(
    path: Path, data: Mapping[str, Any], seen: spaces.Space[Any], actions: spaces.Box, here: EnvInfo
) -> None:
    """Raise `CheckpointError` unless a policy's spaces are those of the environment."""
    advice = (
        f"Make the environment as it was trained in ({here.task} here, control={here.control!r}: "
        "task, control, robot, n_workers and observe_images decide), or wrap it in an agent of "
        "your own (MODULE:FUNCTION)."
    )
    for what, space in (("observation", seen), ("action", actions)):
        said: Any = data.get(f"{what}_space")
        kind = CLASS.search(str(said.get(":type:"))) if isinstance(said, dict) else None
        if kind is None:
            raise CheckpointError(f"{path} does not say for which {what}s its policy was made.")
        expected, found = _shapes_of(space), _shapes_said(said)
        if found is None:
            was = kind[1].rpartition(".")[2]
        elif found != expected:
            was = _words(found)
        else:
            continue
        raise CheckpointError(
            f"{path} is for {what}s of {was}, this environment has {_words(expected)}. {advice}"
        )
    for end, bound in (("low", -1.0), ("high", 1.0)):
        values = _numbers(data["action_space"].get(end))
        if values.size and not np.allclose(values, bound):
            raise CheckpointError(
                f"{path} acts between other bounds: its action space has {end} "
                f"{data['action_space'][end]}, here it is {bound:g}. {advice}"
            )


def _shapes_of(space: spaces.Space[Any]) -> Shapes:
    if isinstance(space, spaces.Dict):
        return {name: tuple(part.shape or ()) for name, part in space.items()}
    return {"": tuple(space.shape or ())}


def _shapes_said(said: Any) -> Shapes | None:
    """Return the shapes that a file's plain part tells of a space; None of one that is neither a
    box nor boxes by name."""
    if not isinstance(said, dict) or ":type:" not in said:
        return None
    if ".box.Box'" in str(said[":type:"]):
        return {"": tuple(map(int, said.get("_shape") or ()))}
    if ".dict.Dict'" in str(said[":type:"]):
        found = BOX.findall(str(said.get("spaces")))
        return {name: tuple(map(int, re.findall(r"\d+", shape))) for name, shape in found}
    return None


def _numbers(text: Any) -> NDArray[np.float64]:
    """Return the numbers that an array was printed as; none where it is no such text."""
    return np.array(re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", str(text or "")), float)


def _words(shapes: Shapes) -> str:
    def one(shape: tuple[int, ...]) -> str:
        return " x ".join(map(str, shape)) + " numbers" if shape else "no numbers"

    if set(shapes) == {""}:
        return one(shapes[""])
    return "; ".join(f"{name!r}: {one(shape)}" for name, shape in shapes.items()) or "no parts"


# Architecture


def _architecture(
    path: Path, data: Mapping[str, Any], trust: bool
) -> tuple[Callable[..., BasePolicy], dict[str, Any]]:
    """Return the function that makes the policy, and its arguments beside the spaces."""
    kind, said = data.get("policy_class"), data.get("policy_kwargs", {})
    if not isinstance(kind, dict) or not isinstance(said, dict):
        raise CheckpointError(f"{path} does not say which policy it holds.")
    make, unread = _known_policy(kind), list[str]()
    if make is None:
        unread.append(f"its policy ({kind.get('__module__', 'unknown')})")
    keywords, strange = _plain_keywords(said)
    unread += [f"{name} ({value})" for name, value in strange.items()]
    if unread and not trust:
        raise CheckpointError(
            f"{path} can only be read with its pickle: {', '.join(unread)} is not of "
            f"Stable-Baselines3. A pickle runs code of whoever made the file. {TRUST}"
        )
    if make is None:
        make = _unpickled(path, "policy_class", kind, type)
    if strange:
        whole = _unpickled(path, "policy_kwargs", said, dict)
        keywords = {name: each for name, each in whole.items() if name not in NOT_FOR_ACTING}
    if data.get("use_sde") is True:
        keywords = {"use_sde": True, **keywords}
    return make, keywords


def _known_policy(kind: Mapping[str, Any]) -> Callable[..., BasePolicy] | None:
    """Return a policy's class by its module and the name that its constructor is printed with."""
    module = str(kind.get("__module__"))
    found = re.match(r"<function (\w+)\.__init__ ", str(kind.get("__init__")))
    if found is None or found[1] not in POLICIES.get(module, ()):
        return None
    return getattr(import_module(module), found[1])


def _plain_keywords(said: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, str]]:
    """Return a policy's arguments as far as they are plain, and the words of those that are not."""
    given = {name: each for name, each in said.items() if name not in NOT_FOR_ACTING}
    is_whole = PICKLED not in said  # then all of it is JSON
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
    return plain, strange


def _unpickled(path: Path, name: str, said: Mapping[str, Any], expected: type) -> Any:
    import cloudpickle

    try:
        found = cloudpickle.loads(base64.b64decode(said[PICKLED]))
    except Exception as error:  # whatever objects of others raise
        raise CheckpointError(
            f"The {name} of {path} cannot be unpickled here ({type(error).__name__}: {error}). "
            "What it is made of must be importable from here."
        ) from error
    if not isinstance(found, expected):
        raise CheckpointError(
            f"The {name} of {path} must be a {expected.__name__}, got {described(found)}."
        )
    return found


def _built(
    path: Path, make: Callable[[], BasePolicy], weights: Mapping[str, torch.Tensor]
) -> BasePolicy:
    try:
        policy = make().to("cpu")
        policy.load_state_dict(weights)
    except Exception as error:  # of a constructor with arguments from a file
        first = " ".join(str(error).split())[:300]
        raise CheckpointError(
            f"The weights in {path} are not those of the policy that it describes ({first})."
        ) from error
    policy.set_training_mode(False)
    return policy


# Observations that were scaled


def statistics_beside(path: Path) -> Path | None:
    """Return the file of `VecNormalize` that belongs to a policy's; None: there is none.

    It is called as Stable-Baselines3's `CheckpointCallback` and its Zoo call theirs:
    vecnormalize.pkl, NAME_vecnormalize.pkl, NAME_vecnormalize_1000_steps.pkl.
    """
    steps = re.sub(r"_(\d+_steps)$", r"_vecnormalize_\1", path.stem)
    names = (f"{path.stem}_vecnormalize.pkl", f"{steps}.pkl", "vecnormalize.pkl")
    return next((file for name in names if (file := path.with_name(name)).is_file()), None)


def _statistics(path: Path, trust: bool) -> Statistics | None:
    file = statistics_beside(path)
    if file is None:
        return None
    if not trust:
        raise CheckpointError(
            f"Beside {path.name} lies {file}: by its statistics VecNormalize scaled what the "
            "policy saw or earned. It is a pickle, which runs code of whoever made it when it is "
            "read. "
            f"{TRUST} If the policy saw observations as they are, move that file away."
        )
    try:
        wrapper = pickle.loads(file.read_bytes())
    except Exception as error:
        raise CheckpointError(f"{file} cannot be unpickled ({error}).") from error
    if not isinstance(wrapper, VecNormalize):
        raise CheckpointError(
            f"{file} must hold the statistics of a VecNormalize, and holds "
            f"{type(wrapper).__name__}."
        )
    wrapper.training = False
    return Statistics(wrapper) if wrapper.norm_obs else None
