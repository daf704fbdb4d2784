"""Trained policies as files that execute nothing: weights as safetensors, and a card beside them.

`hrc://HRCReach-v0/NAME` is one that comes with the package; NAME.safetensors is any other that
`python -m hrc_env export` wrote. The card (NAME.json) says what it was made for, how, and what it
is worth; its SHA-256 holds the weights to it.
"""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

from hrc_env.core.errors import CheckpointError, ConfigError, unknown
from hrc_env.core.mapping import from_mapping
from hrc_env.core.results import Metric
from hrc_env.tasks.goal import ACHIEVED, DESIRED
from hrc_env.tasks.task import ancestor_of

from .env_info import EnvInfo
from .network import Architecture, Network

PREFIX, SUFFIX = "hrc://", ".safetensors"
FOLDER = Path(__file__).parent / "pretrained"
"""Those that come with the package, as ID/NAME.safetensors."""
EXPORT = "python -m hrc_env export RUN --name NAME"


@dataclass(frozen=True, slots=True)
class TermSize:
    """A term of the observation."""

    name: str
    entries: int
    scale: float
    """What one unit stands for."""


@dataclass(frozen=True, slots=True)
class Worth:
    """Means over episodes on fixed seeds, deterministic actions, with 95 % intervals."""

    shield: str
    """Its name, or "none"."""
    episodes: int
    seed: int
    """Of the first episode."""
    goals_per_minute: Metric
    cost_per_episode: Metric
    contacts_per_episode: Metric


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """What a policy was made for, how, and what it is worth."""

    task: str
    """The environment's id."""
    control: str
    observation: tuple[TermSize, ...]
    n_actions: int
    architecture: Architecture
    command: str
    """That trained it."""
    seed: int
    timesteps: int
    hrc_env: str
    """Version."""
    commit: str | None
    sha256: str
    """Of the weights' file."""
    worth: tuple[Worth, ...]
    """As judged when it was exported."""


def names() -> tuple[str, ...]:
    """Addresses of the policies that come with the package."""
    return tuple(
        f"{PREFIX}{path.parent.name}/{path.stem}" for path in sorted(FOLDER.glob(f"*/*{SUFFIX}"))
    )


def path_of(policy: str) -> Path:
    """The file of a policy by its address or its path.

    Raises:
        ConfigError: no such policy comes with the package.
    """
    if not policy.startswith(PREFIX):
        return Path(policy)
    if policy not in names():
        error = unknown("policy", policy, names()) if names() else "No policies come with it yet."
        raise ConfigError(f"{error} Or train your own, and: {EXPORT}")
    return FOLDER / f"{policy.removeprefix(PREFIX)}{SUFFIX}"


def read(path: Path) -> tuple[Card, Network]:
    """A policy's card and its network.

    Raises:
        CheckpointError: no file, no card, one that is no card, weights that are not those of the
            card, or no safetensors.
    """
    card_path = path.with_suffix(".json")
    for each in (path, card_path):
        if not each.exists():
            raise CheckpointError(f"No {each}: a policy is NAME{SUFFIX} and NAME.json; {EXPORT}")
    try:
        card = from_mapping(Card, json.loads(card_path.read_text()))
    except (ConfigError, ValueError, AttributeError) as error:
        raise CheckpointError(f"{card_path} is no card of a policy: {error}") from error
    content = path.read_bytes()
    if content[:1] == b"\x80" or content[:2] == b"PK":
        raise CheckpointError(
            f"{path} is a pickled file, which could run anything, and is not read. Policies are "
            f"safetensors: {EXPORT}"
        )
    found = hashlib.sha256(content).hexdigest()
    if found != card.sha256:
        raise CheckpointError(
            f"{path} is damaged, or not the one of its card: its SHA-256 is {found}, the card says "
            f"{card.sha256}. Fetch or export it again."
        )
    return card, _network(path, content, card)


def load(path: Path, env_info: EnvInfo) -> Network:
    """A policy that acts in an environment.

    Raises:
        CheckpointError: as of `read`; or it was made for another environment.
    """
    card, network = read(path)
    apart = differences(card, env_info)
    if apart:
        raise CheckpointError(
            f"{path} does not fit this environment: {'; '.join(apart)}. It was trained by: "
            f"{card.command}"
        )
    return network


def differences(card: Card, env_info: EnvInfo) -> list[str]:
    """What of an environment is not as the policy was made for, in words."""
    said = [
        f"its {what} is {of}, here it is {here}"
        for what, of, here in (
            ("task", card.task, ancestor_of(env_info.task, [card.task])),
            ("control", card.control, env_info.control),
            ("number of actions", card.n_actions, env_info.n_actions),
        )
        if of != here
    ]
    seen, here = ({each.name: each for each in of} for of in (card.observation, terms(env_info)))
    for name in [*seen, *(here.keys() - seen.keys())]:
        if seen.get(name) != here.get(name):
            of, to = (_words(each.get(name)) for each in (seen, here))
            said.append(f"its observation's {name} has {of}, here {to}")
    if not said and list(seen) != list(here):
        said.append("its observation's terms come in another order")
    return said


def terms(env_info: EnvInfo) -> tuple[TermSize, ...]:
    """What an observation is made of, in its order; goals that stand apart come first."""
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


def _words(term: TermSize | None) -> str:
    return "no entries" if term is None else f"{term.entries} entries of {term.scale:g}"


def _network(path: Path, content: bytes, card: Card) -> Network:
    from safetensors import SafetensorError
    from safetensors.numpy import load as tensors_of

    try:
        network = Network(tensors_of(content), card.architecture)
    except (SafetensorError, KeyError) as error:
        raise CheckpointError(f"{path} holds no policy: {error}. {EXPORT}") from error
    n_seen = sum(term.entries for term in card.observation)
    n_seen += next((term.entries for term in card.observation if term.name == ACHIEVED), 0) * (
        card.architecture.near_and_far
    )
    if network.sizes != (n_seen, card.n_actions):
        raise CheckpointError(
            f"{path} is a network from {network.sizes[0]} to {network.sizes[1]} numbers; its card "
            f"says {n_seen} and {card.n_actions}."
        )
    return network
