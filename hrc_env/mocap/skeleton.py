"""Assignment of a skeleton's nodes to the 15 joints, and the position of the nose."""

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINTS, N_JOINTS
from hrc_env.core.typing import Floats, Points3
from hrc_env.mocap.names import HEAD, SIDED, Reading, find_cost, find_nodes, has_side, read_name
from hrc_env.mocap.person import measure_stature, midpoint, span
from hrc_env.mocap.record import Moving

__all__ = ["HEAD", "SIDED", "JointNodes", "extract_joints", "find_joints", "find_rest_up"]

CHAINS = tuple(
    tuple(f"{side}_{part}" for part in parts)
    for side in ("left", "right")
    for parts in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle", "foot"))
)
"""Joints of each limb; each joint is a descendant of the one before in the tree."""
CHOICES = 6
"""Maximum number of candidate nodes for a joint."""
NOSE_SHARE = 0.065
"""Distance of the nose ahead of the head's joint in the worker models, divided by stature."""
STANDS = -0.7
"""Cosine of the angle between trunk and thighs below which a rest pose is a standing pose."""


@dataclass(frozen=True, slots=True)
class JointNodes:
    """Nodes of a skeleton that represent the joints."""

    node: dict[str, int]
    """Index of the node of each joint; the nose is included only if the file contains it."""
    head: int
    """Index of the node that rotates with the face."""
    notes: tuple[str, ...] = ()
    """Descriptions of the joints recognized by the skeleton's structure, one sentence each."""


class _Candidate(NamedTuple):
    """A node that may represent a joint according to its name."""

    cost: float
    """Cost of interpreting the node's name as that of the joint."""
    node: int
    """Index of the node."""


def find_joints(moving: Moving, source: str, joints: Mapping[str, str] | None = None) -> JointNodes:
    """Find the node of each joint by the names of the nodes and the structure of the skeleton.

    Args:
        moving: skeleton of a file.
        source: name of the file, for error messages.
        joints: explicit names of nodes, by joint (`names.NAMED`).

    Raises:
        ConfigError: a joint is missing; the message lists those that were found.
    """
    names, parent = moving.names, moving.parent.tolist()
    given = find_nodes(joints or {}, names, source)
    readings = [read_name(name) for name in names]
    known = {joint: _list_candidates(joint, readings) for joint in JOINTS}
    known |= {joint: [_Candidate(0.0, node)] for joint, node in given.items() if joint in JOINTS}
    notes = [*_infer_middle_joints(known, names, parent)]
    nodes: dict[str, int] = {}
    for chain in CHAINS:
        nodes |= _choose_chain(chain, known, parent)
    by_cost = sorted(filter(known.get, known), key=lambda joint: known[joint][0].cost)
    for joint in by_cost:
        free = [node for _, node in known[joint] if node not in nodes.values()]
        if joint not in nodes and free:
            nodes[joint] = free[0]
    head = given.get("head", _find_head(readings))
    if head is None and {"left_shoulder", "right_shoulder"} <= {*nodes}:
        head = _find_top(nodes, names, parent)
        if head is not None:
            notes.append(f"The head is assumed to be {names[head]}, where the trunk ends.")
    missed = [joint for joint in JOINTS[1:] if joint not in nodes]
    missed += ["head"] if head is None else []
    if missed or head is None:
        there = [f"{joint} = {names[nodes[joint]]}" for joint in JOINTS if joint in nodes]
        raise ConfigError(
            f"{source}: an unknown skeleton. Missing: {', '.join(missed)}. Found: "
            f"{', '.join(there) or 'none'}. The file has: {', '.join(names)}. Name the joints "
            f"(--joint {missed[0]}=NAME, joints={{{missed[0]!r}: NAME}}), or rename them as in "
            "docs/motion_capture.md."
        )
    return JointNodes(nodes, head, tuple(notes))


def _list_candidates(joint: str, readings: list[list[Reading]]) -> list[_Candidate]:
    """Return the nodes that may represent a joint according to their names, by increasing cost."""
    side, _, part = joint.partition("_")
    words, side = (SIDED[part], side) if part else ((joint,), "")
    costs = [find_cost(words, side, ways) for ways in readings]
    return sorted(_Candidate(cost, k) for k, cost in enumerate(costs) if cost < np.inf)[:CHOICES]


def _list_ancestors(node: int, parent: list[int]) -> list[int]:
    """Return the ancestors of a node, the nearest first."""
    nodes = []
    while (node := parent[node]) >= 0:
        nodes.append(node)
    return nodes


def _choose_chain(
    chain: tuple[str, ...], known: dict[str, list[_Candidate]], parent: list[int]
) -> dict[str, int]:
    """Return the nodes of a limb's joints with the least total cost, by joint.

    Each node must be a descendant of the previous one. If there are no such nodes, the result is
    empty.

    Args:
        chain: joints of the limb.
        known: candidates of each joint.
        parent: parent of each node.
    """
    choices = [(0.0, list[int]())]
    for joint in chain:
        choices = [
            (cost + candidate.cost, [*nodes, candidate.node])
            for cost, nodes in choices
            for candidate in known[joint]
            if not nodes or nodes[-1] in _list_ancestors(candidate.node, parent)
        ]
    return dict(zip(chain, min(choices)[1], strict=True)) if choices else {}


def _infer_middle_joints(
    known: dict[str, list[_Candidate]], names: tuple[str, ...], parent: list[int]
) -> Iterator[str]:
    """Infer elbows and knees that have no known name on either side, and yield a note on each.

    The only node between shoulder and wrist, or between hip and ankle, becomes the candidate.

    Args:
        known: candidates of each joint, to which the nodes are added.
        names: names of the nodes.
        parent: parent of each node.
    """
    for upper, part, lower in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")):
        sides = ("left_", "right_")
        if any(known[side + part] for side in sides):
            continue
        inferred = {}
        for side in sides:
            for top, end in itertools.product(known[side + upper], known[side + lower]):
                path = _list_ancestors(end.node, parent)
                if path[1:2] == [top.node] and side not in inferred:
                    inferred[side] = path[0], top.node, end.node
        if len(inferred) == len(sides):
            for side, (node, top, end) in inferred.items():
                known[side + part] = [_Candidate(0.0, node)]
                yield (
                    f"{side + part} is assumed to be {names[node]}, which lies between "
                    f"{names[top]} and {names[end]}."
                )


def _find_head(readings: list[list[Reading]]) -> int | None:
    """Return the node with a name of the head, or None if there is none."""
    costs = [find_cost(HEAD, "", ways) for ways in readings]
    best = int(np.argmin(costs))
    return best if costs[best] < np.inf else None


def _find_top(nodes: dict[str, int], names: tuple[str, ...], parent: list[int]) -> int | None:
    """Return the last node of the central branch above the shoulders, or None if it is not unique.

    Args:
        nodes: nodes of the joints.
        names: names of the nodes.
        parent: parent of each node.
    """
    left, right = (_list_ancestors(nodes[f"{side}_shoulder"], parent) for side in ("left", "right"))
    limbs, top = {*left, *right, *nodes.values()}, None
    node = next((ancestor for ancestor in left if ancestor in right), -1)
    while node >= 0:
        ahead = [
            child
            for child, above in enumerate(parent)
            if above == node
            and child not in limbs
            and not names[child].endswith(" end")
            and not has_side(names[child])
        ]
        if len(ahead) > 1:
            return None
        node = ahead[0] if ahead else -1
        top = node if ahead else top
    return top


def extract_joints(moving: Moving, nodes: JointNodes) -> Points3:
    """Return the joints (T, 15, 3) in the file's frame and unit; a missing nose is estimated."""
    order = [nodes.node.get(joint, nodes.head) for joint in JOINTS]
    joints = moving.position[:, order].copy()
    if JOINTS[0] not in nodes.node:
        ahead = _find_face_direction(joints, moving, moving.rest[order], nodes.head)
        joints[:, 0] += (
            NOSE_SHARE * measure_stature(joints) * (moving.rotation[:, nodes.head] @ ahead)
        )
    return joints


def find_rest_up(moving: Moving, nodes: JointNodes) -> Points3:
    """Return the unit vector (3,) from hips to shoulders in a standing rest pose, otherwise NaN."""
    rest = moving.rest[[nodes.node.get(joint, nodes.head) for joint in JOINTS]]
    if not _is_standing(rest):
        return np.full(3, np.nan)
    trunk = midpoint(rest, "shoulder") - midpoint(rest, "hip")
    return trunk / np.linalg.norm(trunk)


def _find_face_direction(joints: Points3, moving: Moving, rest: Points3, head: int) -> Floats:
    """Return the face's direction (3,) in the head's frame.

    If the rest pose is a standing pose, the direction is determined from it, otherwise from the
    mean forward direction of the trunk in the motion.

    Args:
        joints: joints (T, 15, 3).
        moving: skeleton of the file.
        rest: joints (15, 3) at rest.
        head: node that rotates with the face.
    """
    if _is_standing(rest):
        return _find_forward(rest)
    local = np.swapaxes(moving.rotation[:, head], -1, -2) @ _find_forward(joints)[..., None]
    mean = np.nanmean(local[..., 0], axis=0)
    return mean / np.linalg.norm(mean)


def _is_standing(rest: Points3) -> bool:
    """Return whether a rest pose (15, 3) has legs below the trunk and separate shoulders."""
    if rest.shape != (N_JOINTS, 3):
        return False
    trunk = midpoint(rest, "shoulder") - midpoint(rest, "hip")
    thighs = midpoint(rest, "knee") - midpoint(rest, "hip")
    wide = np.linalg.norm(span(rest, "shoulder")) > 0.3 * np.linalg.norm(trunk)
    norms = np.linalg.norm(trunk) * np.linalg.norm(thighs)
    return bool(wide and norms > 0.0 and trunk @ thighs < STANDS * norms)


def _find_forward(joints: Points3) -> Points3:
    """Return the forward unit vectors (..., 3) of a trunk; the feet determine the sign."""
    trunk = midpoint(joints, "shoulder") - midpoint(joints, "hip")
    ahead = np.cross(span(joints, "shoulder") + span(joints, "hip"), trunk)
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    feet = midpoint(joints, "foot") - midpoint(joints, "ankle")
    sign = np.sign(np.nanmean((ahead * feet).sum(-1)))
    return ahead * (sign or 1.0)
