"""BVH: a tree of joints, each with its own order of channels, then a row of numbers a frame."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats, Ints, Points3, Rotations
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.record import FEWEST_FRAMES, Moving, at_rest, forward
from hrc_env.mocap.rows import Rows, separate_numbers, to_number

CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "xyz")
COMMENTS = "#|//"
"""Signs that a comment follows."""
LEAST_SHARE = 0.5
"""A file with less than this share of the frames it announces is refused; judgement."""
LIMB = 4
"""Nodes one after the other, a tip included, that a leg or a trunk with an arm has at least."""
NEAR_ZERO = 0.5
"""Places of a bone that are a smaller share of its OFFSET are meant to be added to it."""


@dataclass(slots=True)
class _Node:
    """One node of the hierarchy as it is being read; parent -1: none."""

    name: str
    parent: int
    offset: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    channels: list[str] = field(default_factory=list)


class _Moved(NamedTuple):
    """Nodes in their parents' frames over time."""

    offset: Points3
    """(T, N, 3) places [unit of the file]."""
    rotation: Rotations
    """(T, N, 3, 3)."""
    stated: dict[int, Points3]
    """(3,) OFFSET of the nodes that carry the whole body and have places, 0 in other axes."""
    repaired: tuple[str, ...]
    """Deviations from the format, a sentence each."""


def read_bvh(path: Path) -> Moving:
    """A BVH file's skeleton over time; `ConfigError` where it is none, or cut off too early."""
    rows = Rows(path, COMMENTS)
    nodes = _read_tree(rows)
    announced = _after("frames?", rows, "Frames:")
    seconds = _after(r"frame\s*time", rows, "Frame Time:")
    if not np.isfinite(announced):
        raise rows.wrong("expected how many frames there are")
    values, repaired = _frames(rows, sum(len(node.channels) for node in nodes), int(announced))
    parent = np.array([node.parent for node in nodes])
    moved = _moved(nodes, parent, values)
    position, rotation = forward(parent, moved.offset, moved.rotation)
    shift = np.zeros((len(values), 3))
    for node, stated in moved.stated.items():
        above = parent[node]
        shift += stated if above < 0 else rotation[:, above] @ stated
    rest = at_rest(parent, np.array([node.offset for node in nodes]))
    fps = round(1.0 / seconds, 2) if seconds > 0.0 else 0.0  # 0.033333 s is 30 Hz
    names = tuple(node.name for node in nodes)
    told = (*repaired, *moved.repaired)
    return Moving(names, parent, position, rotation, rest, fps, shift, told)


def _after(pattern: str, rows: Rows, title: str) -> float:
    """The number after a title on the next line, with or without colon and blanks."""
    text = " ".join(rows.next(title))
    found = re.fullmatch(rf"{pattern}\s*:?\s*(\S+)", text, re.IGNORECASE)
    if not found:
        raise rows.wrong('expected "Frames: N" and "Frame Time: seconds" after MOTION')
    return rows.numbers([found[1]], 1)[0]


def _read_tree(rows: Rows) -> list[_Node]:
    """Everything before MOTION."""
    if rows.next("HIERARCHY")[0].upper() != "HIERARCHY":
        raise rows.wrong("a BVH file begins with the word HIERARCHY")
    nodes, open_nodes = list[_Node](), list[int]()
    for words in _statements(rows):
        word = words[0].upper()
        if word in ("ROOT", "JOINT", "END", "ENDSITE"):
            above = open_nodes[-1] if open_nodes else -1
            is_tip = word.startswith("END") and nodes
            called = f"{nodes[above].name} end" if is_tip else " ".join(words[1:])
            nodes.append(_Node(called, above))
        elif word == "{" and nodes:
            open_nodes.append(len(nodes) - 1)
        elif word == "}" and open_nodes:
            open_nodes.pop()
        elif word == "OFFSET" and open_nodes:
            nodes[open_nodes[-1]].offset = rows.numbers(words[1:], 3)
        elif word == "CHANNELS" and open_nodes:
            nodes[open_nodes[-1]].channels = _channels(words, rows)
        elif word == "MOTION" and nodes and not open_nodes:
            break
        else:
            raise rows.wrong("expected ROOT, JOINT, End Site, OFFSET, CHANNELS, braces or MOTION")
    return nodes


def _statements(rows: Rows) -> Iterator[list[str]]:
    """Words of a line, or the parts of one that has braces among them."""
    while True:
        for part in re.split(r"([{}])", " ".join(rows.next("the skeleton"))):
            if words := part.split():
                yield words


def _channels(words: list[str], rows: Rows) -> list[str]:
    """Names of a joint's channels, lower case."""
    named = [word.lower() for word in words[2:]]
    if words[1:2] != [str(len(named))] or any(name not in CHANNELS for name in named):
        raise rows.wrong(f"expected CHANNELS, their number, and as many of {', '.join(CHANNELS)}")
    return named


def _frames(rows: Rows, width: int, announced: int) -> tuple[Floats, tuple[str, ...]]:
    """(T, width) the numbers of the frames, an incomplete last line left out; what was mended."""
    first, lines = rows.at, [separate_numbers(words, width) for words in rows.rest()]
    if lines and len(lines[-1]) < width:
        lines.pop()
    for k, words in enumerate(lines):
        if len(words) != width:
            raise ConfigError(
                f"{rows.source}: a frame has {width} numbers, one a channel; "
                f"frame {k + 1} (about line {first + k + 1}) has {len(words)}."
            )
    values = _numbers(lines, rows.source).reshape(len(lines), width)
    there = len(values)
    if there < max(FEWEST_FRAMES, LEAST_SHARE * announced):
        raise ConfigError(
            f"{rows.source} is cut off: it announces {announced} frames, {there} are there."
        )
    if there == announced:
        return values, ()
    kept = min(there, announced) if announced >= FEWEST_FRAMES else there
    told = f"{announced} frames are announced, {there} are there: {kept} are used."
    return values[:kept], (told,)


def _numbers(lines: list[list[str]], source: str) -> Floats:
    """The numbers in lines of words, NaN for those that are missing."""
    try:
        values = np.array(lines, dtype=float)
    except ValueError:
        try:
            values = np.array([[to_number(word) for word in words] for words in lines])
        except ValueError as error:
            raise ConfigError(f"{source}: expected numbers in its frames; {error}.") from None
    return np.where(np.isfinite(values), values, np.nan)


def _moved(nodes: list[_Node], parent: Ints, values: Floats) -> _Moved:
    """Return every node in its parent's frame; its position channels replace its OFFSET.

    Some programs write displacements from the OFFSET of a bone, which are recognized by their small
    size and added. The position of the whole body has no such mark (see `Moving.shift`).
    """
    offset = np.repeat(np.array([node.offset for node in nodes])[None], len(values), axis=0)
    rotation = np.tile(np.eye(3), (*offset.shape[:2], 1, 1))
    columns, carriers = iter(values.T), _carriers(parent)
    stated, added = dict[int, Points3](), list[str]()
    for node, channels in enumerate(each.channels for each in nodes):
        own, placed = np.zeros(3), np.zeros((len(values), 3))
        for channel in channels:
            if channel.endswith("position"):
                axis = "xyz".index(channel[0])
                own[axis] = nodes[node].offset[axis]
                offset[:, node, axis] = placed[:, axis] = next(columns)
            else:
                turn = about_axis(channel[0], np.radians(next(columns)))
                rotation[:, node] = rotation[:, node] @ turn
        usual = np.linalg.norm(np.nanmedian(placed, axis=0))
        if node in carriers:
            stated[node] = own
        elif usual < NEAR_ZERO * np.linalg.norm(own):
            offset[:, node] += own
            added.append(nodes[node].name)
    told = f"Places of {', '.join(added)} are near 0 and were added to OFFSET."
    return _Moved(offset, rotation, stated, (told,) if added else ())


def _carriers(parent: Ints) -> set[int]:
    """The nodes that carry the whole body: from the root to where legs and trunk part."""
    depth, found = np.ones(len(parent), int), set[int]()
    for node in range(len(parent) - 1, 0, -1):
        if parent[node] >= 0:
            depth[parent[node]] = max(depth[parent[node]], depth[node] + 1)
    limbs = [0]
    while len(limbs) == 1:
        (node,) = limbs
        found.add(node)
        limbs = np.flatnonzero((parent == node) & (depth >= LIMB)).tolist()
    return found
