"""A run's policy as files that execute nothing, with a card of its scores."""

import hashlib
import json
import shlex
from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from typing import Any

import numpy as np
from gymnasium import spaces
from rich.console import Console

from hrc_env import __version__
from hrc_env.core.errors import CheckpointError, learner
from hrc_env.core.progress import progress_bar
from hrc_env.core.results import write_whole
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
from .recipes import filled
from .requests import ExportRequest, TrainingRequest
from .training import ONLY_OF_A_RUN, asked_of

with learner():
    import torch
    from stable_baselines3 import SAC

LEFT_OUT = {*ONLY_OF_A_RUN} - {"timesteps", "engine", "workers"}
"""Arguments that a policy does not depend on."""
ACTIVATIONS = {torch.nn.Tanh: "tanh", torch.nn.ReLU: "relu"}


def run(asked: ExportRequest) -> int:
    """Write weights and card; returns the exit status.

    Raises:
        CheckpointError: the folder holds no run, or there is such a policy already.
    """
    arguments = filled(asked_of(asked.run_folder))
    path = asked.out / arguments.task / f"{asked.name}{SUFFIX}"
    if path.exists():
        raise CheckpointError(f"{path} is there already; give another --name, or delete it.")
    console, kwargs = Console(), arguments.keywords()
    make_ready(console, arguments.perception)
    env = HRCVecEnv(1, **arguments.batched_keywords())
    try:
        here = env_info(env.simulation)
    finally:
        env.close()
    trained = checkpoints.load(asked.run_folder / "policy.zip", here).learner
    n_workers = checkpoints.describe(asked.run_folder / "policy.zip").get("workers")
    engine = {} if n_workers is None else {"engine": "ray", "workers": n_workers}
    arguments = replace(arguments, timesteps=trained.num_timesteps, **engine)
    tensors, architecture = taken(trained)
    network = Network(tensors, architecture)
    content = _packed(tensors)
    shields = dict.fromkeys([arguments.shield or "none", *asked.shields])
    record = json.loads((asked.run_folder / "run.json").read_text())
    card = Card(
        task=here.task, control=here.control, observation=policies.terms(here),
        n_actions=here.n_actions, architecture=architecture, command=command(arguments),
        seed=arguments.seed, timesteps=trained.num_timesteps, hrc_env=__version__,
        commit=record.get("git"), sha256=hashlib.sha256(content).hexdigest(),
        worth=tuple(_worth(network, shield, asked, kwargs, console) for shield in shields),
    )  # fmt: skip
    write_whole(path, content)
    write_whole(path.with_suffix(".json"), json.dumps(asdict(card), indent=1))
    console.print(f"In {path.parent}/: {path.name}, {path.stem}.json", highlight=False)
    return 0


def taken(trained: checkpoints.Learner) -> tuple[Tensors, Architecture]:
    """Return the networks of a learner that act.

    Raises:
        CheckpointError: it sees images: the format has no convolutions.
    """
    space = trained.observation_space
    if isinstance(space, spaces.Dict) and any(name.startswith(IMAGE) for name in space.spaces):
        raise CheckpointError(
            "A policy that sees images cannot be exported: such files hold layers of numbers, no "
            "convolutions. Give its policy.zip instead."
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
    return tensors, Architecture(activation, near_and_far=near, squashed=squashed)


def command(arguments: TrainingRequest) -> str:
    """The line that trains so."""
    words = ["python", "-m", "hrc_env", "train"]
    for each in fields(TrainingRequest):
        value = getattr(arguments, each.name)
        if value == each.default or each.name in LEFT_OUT:
            continue
        several = isinstance(value, tuple | list)
        option = f"--{each.name.replace('_', '-')}"
        words += [option, *map(str, value if several else [value])]
    return shlex.join(words)


def _packed(tensors: Tensors) -> bytes:
    from safetensors.numpy import save

    return save(tensors)


def _worth(
    network: Network,
    shield: str,
    asked: ExportRequest,
    kwargs: Mapping[str, Any],
    console: Console,
) -> Worth:
    """What it is worth on the seeds of evaluations, also printed."""
    with progress_bar(console, f"judged, shield {shield}") as say:
        episodes = play_episodes(
            lambda _: network, asked.episodes, tick=lambda share: say(share, ""),
            **{**kwargs, "shield": read_word(None if shield == "none" else shield)},
        )  # fmt: skip
    found = measure(episodes)
    names = ("goals_per_minute", "cost_per_episode", "contacts_per_episode")
    for name in names:
        told = found[name]
        words = f"  {name:24s}{told.value:.2f} ({told.low:.2f} to {told.high:.2f})"
        console.print(words, highlight=False)
    return Worth(shield, asked.episodes, EVALUATION_SEED, *(found[name] for name in names))
