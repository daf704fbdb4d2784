"""Trained policies in files that load without executing code: safetensors weights and a card.

`hrc://HRCReach-v0/NAME` is a policy that comes with the package; NAME.safetensors is a policy that
`python -m hrc_env export` wrote. The card (NAME.json) describes the policy's environment, training
and scores, and holds the SHA-256 digest of the weights, which is verified when they are loaded.
"""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from hrc_env.core.errors import CheckpointError, ConfigError, make_unknown_name_error
from hrc_env.core.mapping import from_mapping
from hrc_env.core.renamed_keys import describe_renaming
from hrc_env.core.results import Metric
from hrc_env.observations import RENAMED, TermDict
from hrc_env.tasks.goal import ACHIEVED, DESIRED
from hrc_env.tasks.task import ancestor_of

from .env_info import EnvInfo
from .interface import Interface
from .network import Architecture, Network

PREFIX, SUFFIX = "hrc://", ".safetensors"
FOLDER = Path(__file__).parent / "pretrained"
"""Folder of the policies that come with the package, as ID/NAME.safetensors."""
EXPORT = "python -m hrc_env export RUN --name NAME"


@dataclass(frozen=True, slots=True)
class TermSize:
    """Name, size and scale of a term of the observation."""

    name: str
    """Name of the term."""
    entries: int
    """Number of entries of the term."""
    scale: float
    """Physical value that corresponds to 1 in the observation."""


@dataclass(frozen=True, slots=True)
class Worth:
    """Mean scores of a policy with 95 % confidence intervals.

    The episodes have fixed seeds, and actions are deterministic.
    """

    shield: str
    """Name of the shield, or "none"."""
    episodes: int
    """Number of evaluated episodes."""
    seed: int
    """Seed of the first episode."""
    goals_per_minute: Metric
    cost_per_episode: Metric
    contacts_per_episode: Metric


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """The description of a policy: environment, training and scores."""

    task: str
    """Id of the task."""
    control: str
    """Control mode, which defines the meaning of actions: "joint", "tool" or "twist"."""
    observation: tuple[TermSize, ...]
    """Terms of the observation, in their order."""
    n_actions: int
    """Number of entries of an action."""
    architecture: Architecture
    """Architecture of the network."""
    command: str
    """Command that trained the policy."""
    seed: int
    """Seed of the training."""
    timesteps: int
    """Number of environment steps of the training."""
    hrc_env: str
    """Version of this package with which the policy was trained."""
    commit: str | None
    """Git commit of this package at the training, or None if it is unknown."""
    sha256: str
    """SHA-256 digest of the weights file."""
    worth: tuple[Worth, ...]
    """Scores from the evaluations of the export, one entry for each shield."""
    forecast_s: tuple[float, ...] = ()
    """Horizons of the forecasts in the observation [s]."""
    uncertainty: tuple[str, ...] = ()
    """Entries of the observation for the covariance of each joint (`HRCConfig.uncertainty`)."""
    observe_shield: bool = False
    """Whether the observation contains the change of the last command by the shield."""

    @property
    def interface(self) -> Interface:
        """Settings of an environment that the policy needs."""
        return Interface(
            control=self.control,
            forecast_s=self.forecast_s,
            uncertainty=self.uncertainty,
            observe_shield=self.observe_shield,
        )


class Policy(NamedTuple):
    """A policy's card and network, as read from their files."""

    card: Card
    network: Network


def list_names() -> tuple[str, ...]:
    """Return the names ("hrc://...") of the policies that come with the package."""
    return tuple(
        f"{PREFIX}{path.parent.name}/{path.stem}" for path in sorted(FOLDER.glob(f"*/*{SUFFIX}"))
    )


def find_path(policy: str) -> Path:
    """Return the path of the policy with an "hrc://" name; a path is returned unchanged.

    Raises:
        ConfigError: the package has no such policy.
    """
    if not policy.startswith(PREFIX):
        return Path(policy)
    if policy not in list_names():
        names = list_names()
        error = (
            make_unknown_name_error("policy", policy, names)
            if names
            else "The package contains no policies yet."
        )
        raise ConfigError(f"{error} Otherwise, train a policy and export it: {EXPORT}")
    return FOLDER / f"{policy.removeprefix(PREFIX)}{SUFFIX}"


def read(path: Path) -> Policy:
    """Read a policy and its card from their files.

    Raises:
        CheckpointError: a file is missing, the card is invalid, the weights do not match the
            card's digest, or they are not safetensors.
    """
    card_path = path.with_suffix(".json")
    for file in (path, card_path):
        if not file.exists():
            raise CheckpointError(
                f"{file} is missing: a policy consists of NAME{SUFFIX} and "
                f"NAME.json; export one with: {EXPORT}"
            )
    try:
        card = from_mapping(Card, json.loads(card_path.read_text()))
    except (ConfigError, ValueError, AttributeError) as error:
        raise CheckpointError(f"{card_path} is not a model card of a policy: {error}") from error
    content = path.read_bytes()
    if content[:1] == b"\x80" or content[:2] == b"PK":
        raise CheckpointError(
            f"{path} is a pickle, which could execute arbitrary code, and is not loaded. Policies "
            f"are safetensors files; export one with: {EXPORT}"
        )
    digest = hashlib.sha256(content).hexdigest()
    if digest != card.sha256:
        raise CheckpointError(
            f"{path} is damaged or does not belong to its model card: its SHA-256 is {digest}, but "
            f"the card states {card.sha256}. Download or export it again."
        )
    return Policy(card, _load_network(path, content, card))


def load(path: Path, env_info: EnvInfo) -> Network:
    """Load the network of a policy for acting in an environment.

    Raises:
        CheckpointError: the files are invalid (`read`), or the policy is for another environment.
    """
    card, network = read(path)
    different = list_differences(card, env_info)
    if different:
        raise CheckpointError(
            f"{path} does not fit this environment: {'; '.join(different)}. It was trained by: "
            f"{card.command}"
        )
    return network


def list_differences(card: Card, env_info: EnvInfo) -> list[str]:
    """Describe each difference between a policy's training environment and the given one."""
    texts = [
        f"its {name} is {theirs}, but here it is {ours}"
        for name, theirs, ours in (
            ("task", card.task, ancestor_of(env_info.task, [card.task])),
            ("control", card.control, env_info.control),
            ("number of actions", card.n_actions, env_info.n_actions),
            ("forecast_s", card.forecast_s or env_info.forecast_s, env_info.forecast_s),
        )
        if theirs != ours
    ]
    theirs = {term.name: term for term in card.observation}
    ours = {term.name: term for term in list_terms(env_info)}
    renamed = {name: RENAMED[name] for name in theirs.keys() & RENAMED.keys() - ours.keys()}
    texts += [describe_renaming(TermDict.KIND, name, renamed)[:-1] for name in sorted(renamed)]
    for name in [*theirs, *(ours.keys() - theirs.keys())]:
        if name in {*renamed, *renamed.values()}:
            continue
        if theirs.get(name) != ours.get(name):
            old, new = _describe_term(theirs.get(name)), _describe_term(ours.get(name))
            texts.append(f"its observation's {name} has {old}, but here {new}")
    if not texts and list(theirs) != list(ours):
        texts.append("the terms of its observation have a different order")
    return texts


def list_terms(env_info: EnvInfo) -> tuple[TermSize, ...]:
    """Return the terms of an observation in their order; separate goals come first."""
    goals = (ACHIEVED, DESIRED) if env_info.goal_size else ()
    layout = env_info.layout
    present = {name: part for name, part in layout.slices.items() if part.stop > part.start}
    return (
        *(TermSize(name, env_info.goal_size, 1.0) for name in goals),
        *(
            TermSize(name, part.stop - part.start, float(layout.scale[part.start]))
            for name, part in present.items()
        ),
    )


def _describe_term(term: TermSize | None) -> str:
    return "no entries" if term is None else f"{term.entries} entries of {term.scale:g}"


def _load_network(path: Path, content: bytes, card: Card) -> Network:
    from safetensors import SafetensorError
    from safetensors.numpy import load as load_tensors

    try:
        network = Network(load_tensors(content), card.architecture)
    except (SafetensorError, KeyError) as error:
        raise CheckpointError(f"{path} is not a policy: {error}. {EXPORT}") from error
    n_inputs = sum(term.entries for term in card.observation)
    if card.architecture.near_and_far:
        n_inputs += next((t.entries for t in card.observation if t.name == ACHIEVED), 0)
    if network.sizes != (n_inputs, card.n_actions):
        raise CheckpointError(
            f"{path} is a network from {network.sizes.n_inputs} to {network.sizes.n_outputs} "
            f"numbers; its card describes {n_inputs} and {card.n_actions}."
        )
    return network
