"""Reader of BVH files, which contain a tree of joints with channels, and numbers per frame."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats, Ints, Points3, Rotations
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.record import FEWEST_FRAMES, Moving, compose_tree, place_at_rest
from hrc_env.mocap.rows import Rows, separate_numbers, to_number

CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "xyz")
COMMENTS = "#|//"
"""Regular expression of the characters that begin a comment."""
LEAST_SHARE = 0.5
"""Minimum fraction of the announced frames that a file must contain.

The value is an estimate.
"""
LIMB = 4
"""Minimum number of nodes, including the tip, in a chain of a leg or of a trunk with an arm."""
NEAR_ZERO = 0.5
"""Ratio of a bone's positions to its OFFSET below which the positions are added to it."""


@dataclass(slots=True)
class _Node:
    """One node of the hierarchy."""

    name: str
    """Name of the node."""
    parent: int
    """Index of the parent; -1 for none."""
    offset: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    """OFFSET (3,) of the node [unit of the file]."""
    channels: list[str] = field(default_factory=list)
    """Names of the node's channels, in the order of the file."""


class _NodePoses(NamedTuple):
    """Poses of nodes in their parents' frames over time."""

    offset: Points3
    """Positions (T, N, 3) [unit of the file]."""
    rotation: Rotations
    """Rotations (T, N, 3, 3)."""
    stated: dict[int, Points3]
    """OFFSET (3,) of nodes that move the whole body, by node.

    It is 0 along axes without position channels.
    """
    notes: tuple[str, ...]
    """Descriptions of the deviations from the format, one sentence each."""


def read_bvh(path: Path) -> Moving:
    """Read a BVH file; raise `ConfigError` if it has another format or is truncated."""
    rows = Rows(path, COMMENTS)
    nodes = _read_tree(rows)
    announced = _read_after("frames?", rows, "Frames:")
    seconds = _read_after(r"frame\s*time", rows, "Frame Time:")
    if not np.isfinite(announced):
        raise rows.make_error("expected the number of frames")
    values, notes = _read_frames(rows, sum(len(node.channels) for node in nodes), int(announced))
    parent = np.array([node.parent for node in nodes])
    poses = _place_nodes(nodes, parent, values)
    position, rotation = compose_tree(parent, poses.offset, poses.rotation)
    shift = np.zeros((len(values), 3))
    for node, stated in poses.stated.items():
        above = parent[node]
        shift += stated if above < 0 else rotation[:, above] @ stated
    rest = place_at_rest(parent, np.array([node.offset for node in nodes]))
    fps = round(1.0 / seconds, 2) if seconds > 0.0 else 0.0  # 0.033333 s is 30 Hz
    names = tuple(node.name for node in nodes)
    notes = (*notes, *poses.notes)
    return Moving(names, parent, position, rotation, rest, fps, shift, notes)


def _read_after(pattern: str, rows: Rows, title: str) -> float:
    """Return the number after a title on the next line; colon and spaces are optional.

    Args:
        pattern: regular expression of the title.
        rows: lines of the file.
        title: title, for error messages.
    """
    text = " ".join(rows.next(title))
    match = re.fullmatch(rf"{pattern}\s*:?\s*(\S+)", text, re.IGNORECASE)
    if not match:
        raise rows.make_error('expected "Frames: N" and "Frame Time: seconds" after MOTION')
    return rows.to_numbers([match[1]], 1)[0]


def _read_tree(rows: Rows) -> list[_Node]:
    """Read the nodes of the hierarchy, up to the word MOTION."""
    if rows.next("HIERARCHY")[0].upper() != "HIERARCHY":
        raise rows.make_error("a BVH file begins with the word HIERARCHY")
    nodes, open_nodes = list[_Node](), list[int]()
    for words in _split_statements(rows):
        word = words[0].upper()
        if word in ("ROOT", "JOINT", "END", "ENDSITE"):
            above = open_nodes[-1] if open_nodes else -1
            is_tip = word.startswith("END") and nodes
            name = f"{nodes[above].name} end" if is_tip else " ".join(words[1:])
            nodes.append(_Node(name, above))
        elif word == "{" and nodes:
            open_nodes.append(len(nodes) - 1)
        elif word == "}" and open_nodes:
            open_nodes.pop()
        elif word == "OFFSET" and open_nodes:
            nodes[open_nodes[-1]].offset = rows.to_numbers(words[1:], 3)
        elif word == "CHANNELS" and open_nodes:
            nodes[open_nodes[-1]].channels = _read_channels(words, rows)
        elif word == "MOTION" and nodes and not open_nodes:
            break
        else:
            raise rows.make_error(
                "expected ROOT, JOINT, End Site, OFFSET, CHANNELS, braces or MOTION"
            )
    return nodes


def _split_statements(rows: Rows) -> Iterator[list[str]]:
    """Yield the words of each statement, which is a line or a part of a line with braces."""
    while True:
        for part in re.split(r"([{}])", " ".join(rows.next("the skeleton"))):
            if words := part.split():
                yield words


def _read_channels(words: list[str], rows: Rows) -> list[str]:
    """Return the names of a joint's channels in lowercase."""
    named = [word.lower() for word in words[2:]]
    if words[1:2] != [str(len(named))] or any(name not in CHANNELS for name in named):
        raise rows.make_error(
            f"expected CHANNELS, their number, and as many of {', '.join(CHANNELS)}"
        )
    return named


class _Frames(NamedTuple):
    """Numbers in the frames of a file."""

    values: Floats
    """Numbers (T, width)."""
    notes: tuple[str, ...]
    """Descriptions of the deviations from the format, one sentence each."""


def _read_frames(rows: Rows, width: int, announced: int) -> _Frames:
    """Read the numbers of the frames; an incomplete last line is ignored.

    Args:
        rows: lines of the file.
        width: number of channels.
        announced: number of frames according to the header of the file.
    """
    first, lines = rows.at, [separate_numbers(words, width) for words in rows.remaining()]
    if lines and len(lines[-1]) < width:
        lines.pop()
    for k, words in enumerate(lines):
        if len(words) != width:
            raise ConfigError(
                f"{rows.source}: a frame has {width} numbers, one per channel; frame {k + 1} "
                f"(about line {first + k + 1}) has {len(words)}."
            )
    values = _to_numbers(lines, rows.source).reshape(len(lines), width)
    there = len(values)
    if there < max(FEWEST_FRAMES, LEAST_SHARE * announced):
        raise ConfigError(
            f"{rows.source} is truncated: it declares {announced} frames, but contains {there}."
        )
    if there == announced:
        return _Frames(values, ())
    kept = min(there, announced) if announced >= FEWEST_FRAMES else there
    note = f"{announced} frames are declared, but {there} are present: {kept} are used."
    return _Frames(values[:kept], (note,))


def _to_numbers(lines: list[list[str]], source: str) -> Floats:
    """Convert lines of words to numbers, with NaN for missing values."""
    try:
        values = np.array(lines, dtype=float)
    except ValueError:
        try:
            values = np.array([[to_number(word) for word in words] for words in lines])
        except ValueError as error:
            raise ConfigError(f"{source}: expected numbers in its frames; {error}.") from None
    return np.where(np.isfinite(values), values, np.nan)


def _place_nodes(nodes: list[_Node], parent: Ints, values: Floats) -> _NodePoses:
    """Return the poses of nodes in their parents' frames; position channels replace the OFFSET.

    Some programs write the positions of bones relative to their OFFSET. Such positions are
    recognized by their small size and added to the OFFSET. This criterion does not apply to the
    position of the whole body, for which `Moving.shift` is used.

    Args:
        nodes: nodes of the hierarchy.
        parent: parent (N,) of each node.
        values: numbers (T, width) of the frames.
    """
    offset = np.repeat(np.array([node.offset for node in nodes])[None], len(values), axis=0)
    rotation = np.tile(np.eye(3), (*offset.shape[:2], 1, 1))
    columns, carriers = iter(values.T), _find_carriers(parent)
    stated, added = dict[int, Points3](), list[str]()
    for node, channels in enumerate(item.channels for item in nodes):
        position, placed = np.zeros(3), np.zeros((len(values), 3))
        for channel in channels:
            if channel.endswith("position"):
                axis = "xyz".index(channel[0])
                position[axis] = nodes[node].offset[axis]
                offset[:, node, axis] = placed[:, axis] = next(columns)
            else:
                turn = about_axis(channel[0], np.radians(next(columns)))
                rotation[:, node] = rotation[:, node] @ turn
        usual = np.linalg.norm(np.nanmedian(placed, axis=0))
        if node in carriers:
            stated[node] = position
        elif usual < NEAR_ZERO * np.linalg.norm(position):
            offset[:, node] += position
            added.append(nodes[node].name)
    note = f"Positions of {', '.join(added)} are near 0 and were added to OFFSET."
    return _NodePoses(offset, rotation, stated, (note,) if added else ())


def _find_carriers(parent: Ints) -> set[int]:
    """Return the nodes that move the whole body, from the root to the branching of the legs."""
    depth, carriers = np.ones(len(parent), int), set[int]()
    for node in range(len(parent) - 1, 0, -1):
        if parent[node] >= 0:
            depth[parent[node]] = max(depth[parent[node]], depth[node] + 1)
    limbs = [0]
    while len(limbs) == 1:
        (node,) = limbs
        carriers.add(node)
        limbs = np.flatnonzero((parent == node) & (depth >= LIMB)).tolist()
    return carriers
