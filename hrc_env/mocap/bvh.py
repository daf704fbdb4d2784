"""BVH: a tree of joints, each with its own order of channels, then a row of numbers a frame."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats, Rotations
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.record import FEWEST_FRAMES, Moving, Rows, at_rest, forward

CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "xyz")
LEAST_SHARE = 0.5
"""A file with less than this share of the frames it announces is refused; judgement."""


@dataclass(slots=True)
class _Node:
    """One node of the hierarchy as it is being read; parent -1: none."""

    name: str
    parent: int
    offset: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    channels: list[str] = field(default_factory=list)


def read_bvh(path: Path) -> Moving:
    """A BVH file's skeleton over time; `ConfigError` where it is none, or cut off too early."""
    rows = Rows(path)
    nodes = _read_tree(rows)
    count, step = rows.next("Frames:"), rows.next("Frame Time:")
    if count[0].lower() != "frames:" or [w.lower() for w in step[:2]] != ["frame", "time:"]:
        raise rows.wrong('expected "Frames: N" and "Frame Time: seconds" after MOTION')
    announced, seconds = rows.numbers([count[-1], step[-1]])
    values, repaired = _frames(rows, sum(len(node.channels) for node in nodes), int(announced))
    parent = np.array([node.parent for node in nodes])
    position, rotation = forward(parent, *_moved(nodes, values))
    rest = at_rest(parent, np.array([node.offset for node in nodes]))
    fps = round(1.0 / seconds, 2) if seconds > 0.0 else 0.0  # 0.033333 s is 30 Hz
    return Moving(tuple(node.name for node in nodes), position, rotation, rest, fps, repaired)


def _read_tree(rows: Rows) -> list[_Node]:
    """Everything before MOTION."""
    if rows.next("HIERARCHY")[0].upper() != "HIERARCHY":
        raise rows.wrong("a BVH file begins with the word HIERARCHY")
    nodes, open_nodes = list[_Node](), list[int]()
    while True:
        words = rows.next("the skeleton")
        word = words[0].upper()
        if word in ("ROOT", "JOINT", "END"):
            above = open_nodes[-1] if open_nodes else -1
            called = " ".join(words[1:]) if word != "END" else f"{nodes[above].name} end"
            nodes.append(_Node(called, above))
            words = words[-1:] if words[-1] == "{" else [""]
        if words[0] == "{":
            open_nodes.append(len(nodes) - 1)
        elif word == "}" and open_nodes:
            open_nodes.pop()
        elif word == "OFFSET" and open_nodes:
            nodes[open_nodes[-1]].offset = rows.numbers(words[1:4])
        elif word == "CHANNELS" and open_nodes:
            nodes[open_nodes[-1]].channels = _channels(words, rows)
        elif word == "MOTION" and nodes and not open_nodes:
            return nodes
        elif words[0]:
            raise rows.wrong("expected ROOT, JOINT, End Site, OFFSET, CHANNELS, braces or MOTION")


def _channels(words: list[str], rows: Rows) -> list[str]:
    """Names of a joint's channels, lower case."""
    named = [word.lower() for word in words[2:]]
    if words[1:2] != [str(len(named))] or any(name not in CHANNELS for name in named):
        raise rows.wrong(f"expected CHANNELS, their number, and as many of {', '.join(CHANNELS)}")
    return named


def _frames(rows: Rows, width: int, announced: int) -> tuple[Floats, tuple[str, ...]]:
    """(T, width) the numbers of the frames, an incomplete last line left out; what was mended."""
    first, lines = rows.at, list(rows.rest())
    if lines and len(lines[-1]) < width:
        lines.pop()
    for k, words in enumerate(lines):
        if len(words) != width:
            raise ConfigError(
                f"{rows.source}: a frame has {width} numbers, one a channel; "
                f"frame {k + 1} (about line {first + k + 1}) has {len(words)}."
            )
    try:
        values = np.array(lines, dtype=float).reshape(len(lines), width)
    except ValueError as error:
        raise ConfigError(f"{rows.source}: expected numbers in its frames; {error}.") from None
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


def _moved(nodes: list[_Node], values: Floats) -> tuple[Floats, Rotations]:
    """Offsets (T, N, 3) and rotations (T, N, 3, 3) of every node in its parent's frame."""
    offset = np.repeat(np.array([node.offset for node in nodes])[None], len(values), axis=0)
    rotation = np.tile(np.eye(3), (*offset.shape[:2], 1, 1))
    columns = iter(values.T)
    for node, channels in enumerate(each.channels for each in nodes):
        placed = np.zeros((len(values), 3))
        for channel in channels:
            if channel.endswith("position"):
                placed[:, "xyz".index(channel[0])] = next(columns)
            else:
                turn = about_axis(channel[0], np.radians(next(columns)))
                rotation[:, node] = rotation[:, node] @ turn
        if any(channel.endswith("position") for channel in channels):
            # Most programs write the place itself, some what is to be added to OFFSET: small then.
            usual, own = np.linalg.norm(np.nanmedian(placed, axis=0)), offset[0, node].copy()
            offset[:, node] = placed + own if usual < 0.5 * np.linalg.norm(own) else placed
    return offset, rotation
