"""Which node of a file's skeleton is which of the 15 joints, and where its nose is."""

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINTS, N_JOINTS
from hrc_env.core.typing import Floats, Points3
from hrc_env.mocap.names import HEAD, SIDED, Reading, cost_as, has_side, nodes_given, read_name
from hrc_env.mocap.person import across, middle, stature
from hrc_env.mocap.record import Moving

__all__ = ["HEAD", "SIDED", "Found", "find_joints", "joints_of", "rest_up"]

CHAINS = tuple(
    tuple(f"{side}_{part}" for part in parts)
    for side in ("left", "right")
    for parts in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle", "foot"))
)
"""Joints of each limb; each hangs on the one before."""
CHOICES = 6
"""Number of nodes considered for a joint, the best by name."""
NOSE_SHARE, STANDS = 0.065, -0.7
"""From the head's joint forward to the nose, as a share of stature (the baked bodies); a rest pose
stands if the cosine between trunk and thighs is below this."""


@dataclass(frozen=True, slots=True)
class Found:
    """Which nodes of a skeleton the joints are."""

    node: dict[str, int]
    """The node of each joint, the nose only if the file has one."""
    head: int
    """The node that turns with the face."""
    notes: tuple[str, ...] = ()
    """Joints that were recognized by the structure and not by their names, a sentence each."""


class _Candidate(NamedTuple):
    """A node that may be a joint by its name."""

    cost: float
    node: int


def find_joints(moving: Moving, source: str, joints: Mapping[str, str] | None = None) -> Found:
    """Return the node of each joint, by the names of the nodes and the structure of the skeleton.

    Args:
        moving: skeleton of a file.
        source: name of the file, for errors.
        joints: explicit names of nodes, by joint (`NAMED`).

    Raises:
        ConfigError: a joint is missing; the message lists those that were found.
    """
    names, parent = moving.names, moving.parent.tolist()
    given = nodes_given(joints or {}, names, source)
    readings = [read_name(name) for name in names]
    known = {joint: _candidates(joint, readings) for joint in JOINTS}
    known |= {joint: [_Candidate(0.0, node)] for joint, node in given.items() if joint in JOINTS}
    notes = [*_between(known, names, parent)]
    found: dict[str, int] = {}
    for chain in CHAINS:
        found |= _hanging(chain, known, parent)
    for joint in sorted((each for each in known if known[each]), key=lambda j: known[j][0].cost):
        free = [each.node for each in known[joint] if each.node not in found.values()]
        if joint not in found and free:
            found[joint] = free[0]
    head = given.get("head", _head(readings))
    if head is None and {"left_shoulder", "right_shoulder"} <= {*found}:
        head = _top(found, names, parent)
        if head is not None:
            notes.append(f"The head was taken to be {names[head]}: the trunk ends there.")
    missed = [joint for joint in JOINTS[1:] if joint not in found]
    missed += ["head"] if head is None else []
    if missed or head is None:
        there = [f"{joint} = {names[found[joint]]}" for joint in JOINTS if joint in found]
        raise ConfigError(
            f"{source}: an unknown skeleton. Missed: {', '.join(missed)}. Found: "
            f"{', '.join(there) or 'none'}. The file has: {', '.join(names)}. Say which is which "
            f"(--joint {missed[0]}=NAME, joints={{{missed[0]!r}: NAME}}), or rename them as in "
            "docs/people_and_scenes.md."
        )
    return Found(found, head, tuple(notes))


def _candidates(joint: str, readings: list[list[Reading]]) -> list[_Candidate]:
    """Nodes that may be a joint by their names, the best first."""
    side, _, part = joint.partition("_")
    words, where = (SIDED[part], side) if part else ((joint,), "")
    costs = [cost_as(words, where, each) for each in readings]
    return sorted(_Candidate(cost, k) for k, cost in enumerate(costs) if cost < np.inf)[:CHOICES]


def _above(node: int, parent: list[int]) -> list[int]:
    """The nodes that a node hangs on, the nearest first."""
    nodes = []
    while (node := parent[node]) >= 0:
        nodes.append(node)
    return nodes


def _hanging(
    chain: tuple[str, ...], known: dict[str, list[_Candidate]], parent: list[int]
) -> dict[str, int]:
    """The cheapest choice of nodes for a limb's joints of which each hangs on the one before; empty
    if there is none."""
    choices = [(0.0, list[int]())]
    for joint in chain:
        choices = [
            (cost + each.cost, [*nodes, each.node])
            for cost, nodes in choices
            for each in known[joint]
            if not nodes or nodes[-1] in _above(each.node, parent)
        ]
    return dict(zip(chain, min(choices)[1], strict=True)) if choices else {}


def _between(
    known: dict[str, list[_Candidate]], names: tuple[str, ...], parent: list[int]
) -> Iterator[str]:
    """Add the only node between shoulder and wrist, or hip and ankle, to `known` as elbow or knee
    if neither side has a known name for it; yields a sentence for each."""
    for upper, part, lower in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")):
        sides = ("left_", "right_")
        if any(known[side + part] for side in sides):
            continue
        found = {}
        for side in sides:
            for top, end in itertools.product(known[side + upper], known[side + lower]):
                path = _above(end.node, parent)
                if path[1:2] == [top.node] and side not in found:
                    found[side] = path[0], top.node, end.node
        if len(found) == len(sides):
            for side, (node, top, end) in found.items():
                known[side + part] = [_Candidate(0.0, node)]
                yield (
                    f"{side + part} was taken to be {names[node]}, which hangs between "
                    f"{names[top]} and {names[end]}."
                )


def _head(readings: list[list[Reading]]) -> int | None:
    """The node that is called a head."""
    costs = [cost_as(HEAD, "", each) for each in readings]
    best = int(np.argmin(costs))
    return best if costs[best] < np.inf else None


def _top(found: dict[str, int], names: tuple[str, ...], parent: list[int]) -> int | None:
    """The node at the end of the one branch in the middle over the shoulders' common node."""
    left, right = (_above(found[f"{side}_shoulder"], parent) for side in ("left", "right"))
    limbs, top = {*left, *right, *found.values()}, None
    node = next((each for each in left if each in right), -1)
    while node >= 0:
        ahead = [
            child
            for child, above in enumerate(parent)
            if above == node and child not in limbs and not names[child].endswith(" end")
            and not has_side(names[child])
        ]  # fmt: skip
        if len(ahead) > 1:
            return None
        node = ahead[0] if ahead else -1
        top = node if ahead else top
    return top


def joints_of(moving: Moving, found: Found) -> Points3:
    """(T, 15, 3) the joints in the file's frame and unit; a nose is made where it has none."""
    order = [found.node.get(joint, found.head) for joint in JOINTS]
    joints = moving.position[:, order].copy()
    if JOINTS[0] not in found.node:
        ahead = _facing(joints, moving, moving.rest[order], found.head)
        joints[:, 0] += NOSE_SHARE * stature(joints) * (moving.rotation[:, found.head] @ ahead)
    return joints


def rest_up(moving: Moving, found: Found) -> Points3:
    """(3,) unit vector from the hips to the shoulders of the skeleton at rest, if it stands there;
    else NaN."""
    rest = moving.rest[[found.node.get(joint, found.head) for joint in JOINTS]]
    if not _stands(rest):
        return np.full(3, np.nan)
    trunk = middle(rest, "shoulder") - middle(rest, "hip")
    return trunk / np.linalg.norm(trunk)


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
