"""Export of a run's policy as weights, which load without executing code, and a card."""

import hashlib
import json
import shlex
from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from rich.console import Console

from hrc_env import __version__
from hrc_env.core.errors import CheckpointError, learner
from hrc_env.core.progress import progress_bar
from hrc_env.core.results import describe_metric, write_whole
from hrc_env.env_words import read_word
from hrc_env.evaluation.episodes import EVALUATION_SEED, measure, play_episodes
from hrc_env.observations import IMAGE
from hrc_env.pipeline.ready import make_ready
from hrc_env.sb3 import HRCVecEnv

from . import checkpoints, policies
from .env_info import env_info
from .features import NearAndFar
from .network import Architecture, Network, Tensors
from .policies import SUFFIX, Card, Worth
from .recipes import fill_in
from .requests import ExportRequest, TrainingRequest
from .training import ONLY_OF_A_RUN, read_arguments

with learner():
    import torch
    from stable_baselines3 import SAC

LEFT_OUT = {*ONLY_OF_A_RUN} - {"timesteps", "engine", "workers"}
"""Names of the arguments of a run that do not affect its policy."""
ACTIVATIONS = {torch.nn.Tanh: "tanh", torch.nn.ReLU: "relu"}
"""Names of activation functions in an exported policy, by their class."""


class ExportedNetwork(NamedTuple):
    """Weights and architecture of a policy's network."""

    tensors: Tensors
    architecture: Architecture


def run(request: ExportRequest) -> int:
    """Export the policy of a run as weights and a card; return the exit status.

    Raises:
        CheckpointError: the folder holds no run, or the policy exists already.
    """
    arguments = fill_in(read_arguments(request.run_folder))
    path = request.out / arguments.task / f"{request.name}{SUFFIX}"
    if path.exists():
        raise CheckpointError(f"{path} exists already; choose another --name, or delete it.")
    console, kwargs = Console(), arguments.keywords()
    make_ready(console, arguments.perception)
    env = HRCVecEnv(1, **arguments.batched_keywords())
    try:
        info, config = env_info(env.simulation), env.env.config
    finally:
        env.close()
    trained = checkpoints.load(request.run_folder / "policy.zip", info).learner
    n_workers = checkpoints.describe(request.run_folder / "policy.zip").get("workers")
    engine = {} if n_workers is None else {"engine": "ray", "workers": n_workers}
    arguments = replace(arguments, timesteps=trained.num_timesteps, **engine)
    exported = extract_network(trained)
    network = Network(exported.tensors, exported.architecture)
    content = _pack(exported.tensors)
    shields = dict.fromkeys([arguments.shield or "none", *request.shields])
    record = json.loads((request.run_folder / "run.json").read_text())
    card = Card(
        task=info.task, control=info.control, observation=policies.list_terms(info),
        n_actions=info.n_actions, architecture=exported.architecture,
        command=format_command(arguments), seed=arguments.seed, timesteps=trained.num_timesteps,
        hrc_env=__version__, commit=record.get("git"), sha256=hashlib.sha256(content).hexdigest(),
        worth=tuple(_evaluate(network, shield, request, kwargs, console) for shield in shields),
        forecast_s=config.forecast_s, uncertainty=config.uncertainty,
        observe_shield=config.observe_shield,
    )  # fmt: skip
    write_whole(path, content)
    write_whole(path.with_suffix(".json"), json.dumps(asdict(card), indent=1))
    console.print(f"In {path.parent}/: {path.name}, {path.stem}.json", highlight=False)
    return 0


def extract_network(trained: checkpoints.Learner) -> ExportedNetwork:
    """Return the part of a learner's network that computes actions.

    Raises:
        CheckpointError: the network uses images; the format has no convolutions.
    """
    space = trained.observation_space
    if isinstance(space, spaces.Dict) and any(name.startswith(IMAGE) for name in space.spaces):
        raise CheckpointError(
            "A policy that uses images cannot be exported: exported files contain only dense "
            "layers, no convolutions. Use its policy.zip instead."
        )
    policy: Any = trained.policy
    squashed = isinstance(trained, SAC)
    actor = policy.actor if squashed else policy
    layers = [*actor.latent_pi, actor.mu] if squashed else [
        *policy.mlp_extractor.policy_net, policy.action_net
    ]  # fmt: skip
    tensors: Tensors = {}
    for k, layer in enumerate(each for each in layers if isinstance(each, torch.nn.Linear)):
        for part in ("weight", "bias"):
            value = getattr(layer, part).detach().numpy()
            tensors[f"actor.{k}.{part}"] = np.ascontiguousarray(value, np.float32)
    activation = ACTIVATIONS[policy.activation_fn]
    near = isinstance(actor.features_extractor, NearAndFar)
    return ExportedNetwork(tensors, Architecture(activation, near_and_far=near, squashed=squashed))


def format_command(arguments: TrainingRequest) -> str:
    """Return the command line that reproduces a training run."""
    words = ["python", "-m", "hrc_env", "train"]
    for field in fields(TrainingRequest):
        value = getattr(arguments, field.name)
        if value == field.default or field.name in LEFT_OUT:
            continue
        several = isinstance(value, tuple | list)
        option = f"--{field.name.replace('_', '-')}"
        words += [option, *map(str, value if several else [value])]
    return shlex.join(words)


def _pack(tensors: Tensors) -> bytes:
    from safetensors.numpy import save

    return save(tensors)


def _evaluate(
    network: Network,
    shield: str,
    request: ExportRequest,
    kwargs: Mapping[str, Any],
    console: Console,
) -> Worth:
    """Evaluate a policy on the fixed evaluation seeds; print and return its scores."""
    with progress_bar(console, f"evaluating, shield {shield}") as say:
        episodes = play_episodes(
            lambda _: network, request.episodes, tick=lambda share: say(share, ""),
            **{**kwargs, "shield": read_word(None if shield == "none" else shield)},
        )  # fmt: skip
    metrics = measure(episodes)
    names = ("goals_per_minute", "cost_per_episode", "contacts_per_episode")
    for name in names:
        console.print(f"  {name:24s}{describe_metric(metrics[name])}", highlight=False)
    return Worth(shield, request.episodes, EVALUATION_SEED, *(metrics[name] for name in names))
