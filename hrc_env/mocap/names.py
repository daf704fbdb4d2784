"""Interpretation of joint names of many programs, by words for sides and parts of the body."""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from hrc_env.core.errors import ConfigError, check_names, make_unknown_name_error
from hrc_env.core.mapping import read_toml
from hrc_env.core.skeleton import JOINTS

SIDED: dict[str, tuple[str, ...]] = {
    "shoulder": ("uparm", "upperarm", "uarm", "arm", "humerus", "shldr", "bicep", "shoulder"),
    "elbow": ("forearm", "lowerarm", "lowarm", "farm", "radius", "elbow"),
    "wrist": ("wrist", "hand", "forearm end", "lowerarm end", "elbow end"),
    "hip": ("upleg", "upperleg", "thigh", "femur", "hip", "uleg", "leg"),
    "knee": ("lowleg", "lowerleg", "leg", "shin", "calf", "tibia", "knee", "shank", "lleg"),
    "ankle": ("ankle", "foot"),
    "foot": (
        "toebase end",
        "toe end",
        "toes end",
        "toe0 end",
        "ball end",
        "toeend",
        "toetip",
        "toebase",
        "toes",
        "toe0",
        "toe",
        "ball",
        "ankle end",
        "foot end",
        "foot",
    ),
}
"""Names of each joint without prefixes and sides, in the order of preference.

The word for the side may be before, after or inside a name; "x end" is the End Site of joint x.
"""
HEAD: tuple[str, ...] = ("head", "skull", "face")
"""Names of the node that rotates with the face."""
NAMED = (*JOINTS, "head")
"""Names of joints for which a node can be specified explicitly."""
SIDES = {
    **dict.fromkeys(("left", "l", "lft", "lf"), "left"),
    **dict.fromkeys(("right", "r", "rgt", "rt"), "right"),
}
"""Side of the body, by the word or abbreviation for it."""
TAILS = ("joint", "jnt", "jt", "bone", "bn", "bend", "skin", "bind")
"""Words without meaning at the end of a name."""
OWN = frozenset(
    (
        "fore",
        "upper",
        "up",
        "low",
        "lower",
        "u",
        "f",
        "arm",
        "forearm",
        "hand",
        "wrist",
        "elbow",
        "shoulder",
        "shldr",
        "clavicle",
        "collar",
        "leg",
        "thigh",
        "shin",
        "calf",
        "knee",
        "ankle",
        "hip",
        "foot",
        "toe",
        "toes",
        "ball",
        "head",
        "neck",
        "thumb",
        "index",
        "middle",
        "mid",
        "ring",
        "pinky",
        "little",
        "finger",
        "eye",
        "twist",
        "roll",
        "ik",
        "pole",
        "helper",
        "end",
        "nub",
        "tip",
        "share",
        "in",
    )
)
"""Words that must not be omitted from a name, since they change its meaning."""
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
CUT = 0.05
"""Cost of each word omitted before a name, relative to one rank in `SIDED`."""
TAIL = 0.2
"""Cost of each word omitted after a name."""
TURNED = 0.1
"""Cost of two words in reversed order."""


class _Joined(NamedTuple):
    """Several words concatenated to one word."""

    word: str
    """Concatenated word."""
    cost: float
    """Cost of words that were omitted or reversed."""


class Reading(NamedTuple):
    """One interpretation of a node's name."""

    side: str
    """Side of the body: "left", "right" or ""."""
    word: str
    """Part of the body, in lowercase without spaces, followed by " end" for a tip."""
    cost: float
    """Cost of words that were omitted or reversed."""


def read_name(name: str) -> list[Reading]:
    """Return interpretations of a name such as "mixamorig:LeftUpLeg" or "Bip01 L UpperArm"."""
    end, words = " end" if name.endswith(" end") else "", _split_words(name)
    readings, cost = [*_split_readings(words, 0.0)], 0.0
    while len(words) > 1:
        last = len(words) - (2 if words[-1] in SIDES else 1)  # "upper_arm_01_L"
        if not (words[last] in TAILS or words[last].isdigit()):
            break
        number = int(words[last]) if words[last].isdigit() else 0
        cost += TAIL + min(0.01 * number, TAIL)
        del words[last]
        readings += _split_readings(words, cost)
    return [Reading(side, word + end, cost) for side, word, cost in readings]


def has_side(name: str) -> bool:
    """Return whether a name contains a word for left or right."""
    return any(word in SIDES for word in _split_words(name))


def _split_words(name: str) -> list[str]:
    """Return the words of a name in lowercase, without a namespace before a colon."""
    return [word.lower() for word in WORD.findall(name.rsplit(":", 1)[-1].removesuffix(" end"))]


def _split_readings(words: list[str], cost: float) -> Iterator[Reading]:
    """Yield the interpretations of words, with a side at any position and without leading words."""
    for k in [k for k, word in enumerate(words) if word in SIDES]:
        rest = words[:k] + words[k + 1 :]
        yield from (Reading(SIDES[words[k]], word, cost + more) for word, more in _join_words(rest))
    for word, more in _join_words(words):
        yield Reading("", word, cost + more)
        for form, side in SIDES.items():
            if word.startswith(form):
                yield Reading(side, word.removeprefix(form), cost + more)
            if word.endswith(form):
                yield Reading(side, word.removesuffix(form), cost + more)


def _join_words(words: list[str]) -> Iterator[_Joined]:
    """Yield the words concatenated to one word, each time with one leading word less."""
    for k in range(len(words)):
        if k and words[k - 1] in OWN:
            return
        yield _Joined("".join(words[k:]), CUT * k)
        if len(words) - k == 2:
            yield _Joined(words[-1] + words[-2], CUT * k + TURNED)


def find_cost(wanted: Sequence[str], side: str, readings: Sequence[Reading]) -> float:
    """Return the cost of interpreting a name as one of the wanted words; infinite without a match.

    Args:
        wanted: accepted words, in the order of preference.
        side: side of the body: "left", "right" or "".
        readings: interpretations of the name.
    """
    costs = [
        wanted.index(reading.word) + reading.cost
        for reading in readings
        if reading.side == side and reading.word in wanted
    ]
    return min(costs, default=float("inf"))


def read_joint_names(entries: Sequence[str]) -> dict[str, str]:
    """Parse node names of joints, from entries such as "left_shoulder=lShldr".

    An entry may also be the name of a TOML file with such lines.

    Raises:
        ConfigError: an entry has another format, or its joint is unknown.
    """
    given: dict[str, str] = {}
    for entry in entries:
        joint, equals, node = entry.partition("=")
        if entry.lower().endswith(".toml") and (not equals or Path(entry).is_file()):
            content = read_toml(entry)
            given |= content.get("joints", content)
        elif equals and node:
            given[joint.strip()] = node.strip()
        else:
            raise ConfigError(
                "Expected JOINT=NAME, such as left_shoulder=lShldr, or a .toml file with such "
                f"lines, got {entry!r}. Joints: {', '.join(NAMED)}."
            )
    check_names("joint", given, NAMED)
    return given


def find_node(name: object, names: Sequence[str], source: str) -> int:
    """Return the index of the node with a name; case is ignored if there is no exact match."""
    for exact in (True, False):
        for node, known in enumerate(names):
            if known == name or (not exact and known.lower() == str(name).lower()):
                return node
    raise make_unknown_name_error(f"node of {source}", name, names)


def find_nodes(joints: Mapping[str, str], names: Sequence[str], source: str) -> dict[str, int]:
    """Return the indices of the nodes that are specified for joints.

    Args:
        joints: names of the nodes, by joint.
        names: names of all nodes.
        source: name of the file, for error messages.

    Raises:
        ConfigError: a node or joint is unknown, or two joints have the same node.
    """
    check_names("joint", joints, NAMED)
    given = {joint: find_node(name, names, source) for joint, name in joints.items()}
    twice = [joint for joint, node in given.items() if [*given.values()].count(node) > 1]
    if twice:
        raise ConfigError(f"{source}: {', '.join(twice)} must be different nodes.")
    return given
