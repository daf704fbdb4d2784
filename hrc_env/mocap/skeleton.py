"""Which node of a file's skeleton is which of the 15 joints, and where its nose is."""

import re

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINTS, N_JOINTS
from hrc_env.core.typing import Floats, Points3
from hrc_env.mocap.person import across, middle, stature
from hrc_env.mocap.record import Moving

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
"""Names of a joint, best first, without prefixes and sides (which may stand before or behind);
"x end" is the tip (End Site) of joint x."""
HEAD: tuple[str, ...] = ("head", "skull", "face")
"""Names of the node that turns with the face."""
SIDES = {"left": ("left", "l"), "right": ("right", "r")}
NOSE_SHARE, STANDS = 0.065, -0.7
"""From the head's joint forward to the nose, as a share of stature (the baked bodies); a rest pose
stands if the cosine between trunk and thighs is below this."""


def find_joints(names: tuple[str, ...], source: str) -> tuple[dict[str, int], int]:
    """Which node each joint is, {joint: node}, the nose only if the file has one; the head's node.

    "foot" is the ankle where there is none. `ConfigError`, with what was found: a joint is missing.
    """
    known: dict[str, int] = {}
    for node, name in enumerate(_plain(names)):
        known.setdefault(name, node)
    found: dict[str, int] = {}
    for joint in JOINTS:
        side, _, part = joint.partition("_")
        node = _first(SIDED[part], SIDES[side], known) if part else known.get("nose")
        if node is not None and node not in found.values():
            found[joint] = node
    head = _first(HEAD, ("",), known)
    missed = [joint for joint in JOINTS[1:] if joint not in found]
    missed += ["head"] if head is None else []
    if missed or head is None:
        raise ConfigError(
            f"{source}: an unknown skeleton. Missed: {', '.join(missed)}. Found: "
            f"{', '.join(f'{joint} = {names[node]}' for joint, node in found.items()) or 'none'}. "
            f"The file has: {', '.join(names)}. Rename its joints as in docs/people_and_scenes.md."
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


def joints_of(moving: Moving, found: dict[str, int], head: int) -> Points3:
    """(T, 15, 3) the joints in the file's frame and unit; a nose is made where it has none."""
    order = [found.get(joint, head) for joint in JOINTS]
    joints = moving.position[:, order].copy()
    if JOINTS[0] not in found:
        ahead = _facing(joints, moving, moving.rest[order], head)
        joints[:, 0] += NOSE_SHARE * stature(joints) * (moving.rotation[:, head] @ ahead)
    return joints


def _facing(joints: Points3, moving: Moving, rest: Points3, head: int) -> Floats:
    """(3,) the face's direction in the head's frame: from the rest pose if that one stands, else
    straight ahead of the chest, on the mean."""
    if _stands(rest):
        return _ahead(rest)
    local = np.swapaxes(moving.rotation[:, head], -1, -2) @ _ahead(joints)[..., None]
    mean = np.nanmean(local[..., 0], axis=0)
    return mean / np.linalg.norm(mean)


def _stands(rest: Points3) -> bool:
    """Whether a rest pose (15, 3) has its legs below its trunk, its shoulders apart."""
    if rest.shape != (N_JOINTS, 3):
        return False
    trunk = middle(rest, "shoulder") - middle(rest, "hip")
    thighs = middle(rest, "knee") - middle(rest, "hip")
    wide = np.linalg.norm(across(rest, "shoulder")) > 0.3 * np.linalg.norm(trunk)
    norms = np.linalg.norm(trunk) * np.linalg.norm(thighs)
    return bool(wide and norms > 0.0 and trunk @ thighs < STANDS * norms)


def _ahead(joints: Points3) -> Points3:
    """(..., 3) unit vectors forward of a trunk, told from the backward ones by the feet."""
    trunk = middle(joints, "shoulder") - middle(joints, "hip")
    ahead = np.cross(across(joints, "shoulder") + across(joints, "hip"), trunk)
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    feet = middle(joints, "foot") - middle(joints, "ankle")
    sign = np.sign(np.nanmean((ahead * feet).sum(-1)))
    return ahead * (sign or 1.0)
