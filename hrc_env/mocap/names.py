"""The meaning of joint names: words of many programs for a side and a part of the body."""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from hrc_env.core.errors import ConfigError, check_names, unknown
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
        "toebase end", "toe end", "toes end", "toe0 end", "ball end", "toeend", "toetip",
        "toebase", "toes", "toe0", "toe", "ball", "ankle end", "foot end", "foot",
    ),
}  # fmt: skip
"""Names of a joint, best first, without prefixes and sides (which may stand before, behind or in
between); "x end" is the tip (End Site) of joint x."""
HEAD: tuple[str, ...] = ("head", "skull", "face")
"""Names of the node that turns with the face."""
NAMED = (*JOINTS, "head")
"""The names for which a node can be given explicitly."""
SIDES = {
    **dict.fromkeys(("left", "l", "lft", "lf"), "left"),
    **dict.fromkeys(("right", "r", "rgt", "rt"), "right"),
}
"""Words for a side."""
TAILS = ("joint", "jnt", "jt", "bone", "bn", "bend", "skin", "bind")
"""Words behind a name without a meaning."""
OWN = frozenset(
    ("fore", "upper", "up", "low", "lower", "u", "f", "arm", "forearm", "hand", "wrist", "elbow",
     "shoulder", "shldr", "clavicle", "collar", "leg", "thigh", "shin", "calf", "knee", "ankle",
     "hip", "foot", "toe", "toes", "ball", "head", "neck", "thumb", "index", "middle", "mid",
     "ring", "pinky", "little", "finger", "eye", "twist", "roll", "ik", "pole", "helper", "end",
     "nub", "tip", "share", "in")
)  # fmt: skip
"""Words that belong to a name: without one of them it means another part."""
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
CUT, TAIL, TURNED = 0.05, 0.2, 0.1
"""Costs of a reading: for each word that is cut off before, for each behind, and for two words in
reverse order; each better name of the same joint costs 1."""


class Reading(NamedTuple):
    """One way to read a node's name."""

    side: str
    """"left", "right" or ""."""
    word: str
    """The part of the body, in lower case without blanks; with " end" a tip."""
    cost: float
    """The cost of the parts that were left out."""


def read_name(name: str) -> list[Reading]:
    """Return the ways to read a name such as "mixamorig:LeftUpLeg" or "Bip01 L UpperArm"."""
    end, words = " end" if name.endswith(" end") else "", _words(name)
    found, cost = [*_split(words, 0.0)], 0.0
    while len(words) > 1:
        last = len(words) - (2 if words[-1] in SIDES else 1)  # "upper_arm_01_L"
        if not (words[last] in TAILS or words[last].isdigit()):
            break
        number = int(words[last]) if words[last].isdigit() else 0
        cost += TAIL + min(0.01 * number, TAIL)
        del words[last]
        found += _split(words, cost)
    return [Reading(side, word + end, paid) for side, word, paid in found]


def has_side(name: str) -> bool:
    """Return whether a name contains a word for left or right."""
    return any(word in SIDES for word in _words(name))


def _words(name: str) -> list[str]:
    """Return the words of a name in lower case, without a namespace before a colon."""
    return [word.lower() for word in WORD.findall(name.rsplit(":", 1)[-1].removesuffix(" end"))]


def _split(words: list[str], cost: float) -> Iterator[Reading]:
    """Yield readings of words: with a side anywhere or none, without some of the first words."""
    for k in [k for k, word in enumerate(words) if word in SIDES]:
        rest = words[:k] + words[k + 1 :]
        yield from (Reading(SIDES[words[k]], each, cost + more) for each, more in _joined(rest))
    for each, more in _joined(words):
        yield Reading("", each, cost + more)
        for form, side in SIDES.items():
            if each.startswith(form):
                yield Reading(side, each.removeprefix(form), cost + more)
            if each.endswith(form):
                yield Reading(side, each.removesuffix(form), cost + more)


def _joined(words: list[str]) -> Iterator[tuple[str, float]]:
    """Yield words joined to one, without more and more of the first ones, and the cost."""
    for k in range(len(words)):
        if k and words[k - 1] in OWN:
            return
        yield "".join(words[k:]), CUT * k
        if len(words) - k == 2:
            yield words[-1] + words[-2], CUT * k + TURNED


def cost_as(wanted: Sequence[str], side: str, readings: Sequence[Reading]) -> float:
    """Return the cost of reading a name as one of the wanted words, infinite for another name."""
    paid = [
        wanted.index(each.word) + each.cost
        for each in readings
        if each.side == side and each.word in wanted
    ]
    return min(paid, default=float("inf"))


def names_given(entries: Sequence[str]) -> dict[str, str]:
    """Return which node each joint is, of entries "left_shoulder=lShldr" and names of TOML files
    that hold such lines.

    Raises:
        ConfigError: an entry is neither, or names no joint.
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
                f"Expected JOINT=NAME, such as left_shoulder=lShldr, or a .toml file of such "
                f"lines, got {entry!r}. Joints: {', '.join(NAMED)}."
            )
    check_names("joint", given, NAMED)
    return given


def node_called(name: object, names: Sequence[str], source: str) -> int:
    """Return the node of an explicitly given name, whose case does not matter."""
    for exact in (True, False):
        for node, each in enumerate(names):
            if each == name or (not exact and each.lower() == str(name).lower()):
                return node
    raise unknown(f"node of {source}", name, names)


def nodes_given(joints: Mapping[str, str], names: Sequence[str], source: str) -> dict[str, int]:
    """Return the nodes of explicitly named joints; `ConfigError` for an unknown node or joint, and
    for a node of two joints."""
    check_names("joint", joints, NAMED)
    given = {joint: node_called(name, names, source) for joint, name in joints.items()}
    twice = [joint for joint, node in given.items() if [*given.values()].count(node) > 1]
    if twice:
        raise ConfigError(f"{source}: {', '.join(twice)} must be different nodes.")
    return given
