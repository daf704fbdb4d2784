"""Which node of a skeleton is which of the 15 joints: a table of the names that people use."""

import re

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINTS

SIDED: dict[str, tuple[str, ...]] = {
    "shoulder": ("uparm", "upperarm", "arm", "humerus", "shoulder"),
    "elbow": ("forearm", "lowerarm", "lowarm", "radius", "elbow"),
    "wrist": ("wrist", "hand", "forearm end", "lowerarm end", "elbow end"),
    "hip": ("upleg", "upperleg", "thigh", "femur", "hip"),
    "knee": ("lowleg", "lowerleg", "leg", "shin", "calf", "tibia", "knee"),
    "ankle": ("ankle", "foot"),
    "foot": (
        "toebase end", "toe end", "toes end", "toe0 end", "ball end", "toeend", "toetip",
        "toebase", "toes", "toe0", "toe", "ball", "ankle end", "foot end", "foot",
    ),
}  # fmt: skip
"""Names of a joint, best first, without "left" or "right" (which may stand before or behind, as
a word or as l and r) and without prefixes; "x end" is the tip (End Site) of joint x."""
HEAD: tuple[str, ...] = ("head", "skull", "face")
"""Names of the node that turns with the face."""
NOSE: tuple[str, ...] = ("nose",)
SIDES = {"left": ("left", "l"), "right": ("right", "r")}


def find_joints(names: tuple[str, ...], source: str) -> tuple[dict[str, int], int]:
    """Which node each joint is, {joint: node}, and the head's node.

    The nose is among them only if the file has one. "foot" is the ankle where there is no
    ankle, and never both.

    Raises:
        ConfigError: a joint was not found; names those that were, and what the file has.
    """
    known: dict[str, int] = {}
    for node, name in enumerate(_plain(names)):
        known.setdefault(name, node)
    found: dict[str, int] = {}
    for joint in JOINTS:
        side, _, part = joint.partition("_")
        node = _first(SIDED[part], SIDES[side], known) if part else _first(NOSE, ("",), known)
        if node is not None and node not in found.values():
            found[joint] = node
    head = _first(HEAD, ("",), known)
    missed = [joint for joint in JOINTS[1:] if joint not in found]
    missed += ["head"] if head is None else []
    if missed or head is None:
        raise ConfigError(
            f"{source}: an unknown skeleton. Missed: {', '.join(missed)}. Found: "
            f"{', '.join(f'{joint} = {names[node]}' for joint, node in found.items()) or 'none'}. "
            f"The file has: {', '.join(names)}. Rename its joints as in docs/motion_capture.md."
        )
    return found, head


def _plain(names: tuple[str, ...]) -> list[str]:
    """Names in small letters and digits, without what all of them begin with."""
    bare = [name.rsplit(":", 1)[-1] for name in names]
    first, last = min(bare), max(bare)  # what these two begin with, all do
    same = [a == b for a, b in zip(first, last, strict=False)]
    common = first[: same.index(False)] if False in same else first[: len(same)]
    cut = len(common) if re.search(r"[^A-Za-z]$", common) else 0
    return [
        re.sub(r"[^a-z0-9]", "", name[cut:].removesuffix(" end").lower())
        + (" end" if name.endswith(" end") else "")
        for name in bare
    ]


def _first(parts: tuple[str, ...], sides: tuple[str, ...], known: dict[str, int]) -> int | None:
    """The node that the best of some names has."""
    for part in parts:
        word, end = part.removesuffix(" end"), " end" if part.endswith(" end") else ""
        for side in sides:
            for name in (side + word + end, word + side + end):
                if name in known:
                    return known[name]
    return None
