"""BVH: a tree of joints, each with its own order of channels, then a row of numbers a frame."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hrc_env.core.typing import Floats, Rotations
from hrc_env.geometry.rotations import about_axis
from hrc_env.motion.capture.record import Moving, forward
from hrc_env.motion.capture.rows import Rows, number, numbers_of, usable_frames

CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "xyz")


@dataclass(slots=True)
class _Tree:
    """The hierarchy as it is being read."""

    names: list[str] = field(default_factory=list)
    parent: list[int] = field(default_factory=list)
    offset: list[list[float]] = field(default_factory=list)
    channels: list[list[str]] = field(default_factory=list)


def read_bvh(path: Path) -> Moving:
    """A BVH file's skeleton over time.

    Raises:
        ConfigError: no BVH, cut off within the skeleton, or with too few of its frames.
    """
    rows = Rows(path)
    tree = _read_tree(rows)
    frames, seconds = _read_timing(rows)
    width = sum(map(len, tree.channels))
    values, repaired = usable_frames(numbers_of(rows, width), frames, path.name)
    offset, turned = _moved(tree, values)
    parent = np.array(tree.parent)
    position, rotation = forward(parent, offset, turned)
    still = np.broadcast_to(np.eye(3), (1, len(parent), 3, 3))
    rest, _ = forward(parent, np.array(tree.offset)[None], still)
    fps = round(1.0 / seconds, 2) if seconds > 0.0 else 0.0  # 0.033333 s is 30 Hz
    return Moving(tuple(tree.names), position, rotation, rest[0], fps, repaired)


def _read_tree(rows: Rows) -> _Tree:
    """Everything before MOTION."""
    if rows.next("HIERARCHY")[0].upper() != "HIERARCHY":
        raise rows.wrong("a BVH file begins with the word HIERARCHY")
    tree, open_nodes, node = _Tree(), [], -1
    while True:
        words = rows.next("the skeleton")
        word = words[0].upper()
        if word in ("ROOT", "JOINT", "END"):
            above = open_nodes[-1] if open_nodes else -1
            called = " ".join(words[1:]) if word != "END" else f"{tree.names[above]} end"
            tree.names.append(called)
            tree.parent.append(above)
            tree.offset.append([0.0, 0.0, 0.0])
            tree.channels.append([])
            node = len(tree.names) - 1
            words = words[-1:] if words[-1] == "{" else [""]
        if words[0] == "{":
            open_nodes.append(node)
        elif word == "}" and open_nodes:
            open_nodes.pop()
        elif word == "OFFSET" and open_nodes:
            tree.offset[open_nodes[-1]] = [number(w, rows) for w in words[1:4]]
        elif word == "CHANNELS" and open_nodes:
            tree.channels[open_nodes[-1]] = _channels(words, rows)
        elif word == "MOTION" and tree.names and not open_nodes:
            return tree
        elif words[0]:
            raise rows.wrong("expected ROOT, JOINT, End Site, OFFSET, CHANNELS, braces or MOTION")


def _channels(words: list[str], rows: Rows) -> list[str]:
    """Names of a joint's channels, lower case."""
    named = [word.lower() for word in words[2:]]
    if words[1:2] != [str(len(named))] or any(name not in CHANNELS for name in named):
        raise rows.wrong(f"expected CHANNELS, their number, and as many of {', '.join(CHANNELS)}")
    return named


def _read_timing(rows: Rows) -> tuple[int, float]:
    """How many frames the file says it has, and the seconds between two."""
    count, step = rows.next("Frames:"), rows.next("Frame Time:")
    if count[0].lower() != "frames:" or [w.lower() for w in step[:2]] != ["frame", "time:"]:
        raise rows.wrong('expected "Frames: N" and "Frame Time: seconds" after MOTION')
    return int(number(count[-1], rows)), number(step[-1], rows)


def _moved(tree: _Tree, values: Floats) -> tuple[Floats, Rotations]:
    """Offsets (T, N, 3) and rotations (T, N, 3, 3) of every node in its parent's frame."""
    offset = np.repeat(np.array(tree.offset)[None], len(values), axis=0)
    rotation = np.empty((*offset.shape[:2], 3, 3))
    rotation[:] = np.eye(3)
    column = 0
    for node, channels in enumerate(tree.channels):
        given = np.zeros((len(values), 3))
        for channel in channels:
            axis = channel[0]
            if channel.endswith("position"):
                given[:, "xyz".index(axis)] = values[:, column]
            else:
                turn = about_axis(axis, np.radians(values[:, column]))
                rotation[:, node] = rotation[:, node] @ turn
            column += 1
        if any(channel.endswith("position") for channel in channels):
            offset[:, node] = _placed(offset[0, node], given)
    return offset, rotation


def _placed(offset: Floats, given: Floats) -> Floats:
    """(T, 3) where position channels put a node.

    Most programs write the place itself, some what is to be added to OFFSET; then the numbers
    are small beside it.
    """
    added = np.linalg.norm(np.nanmedian(given, axis=0)) < 0.5 * np.linalg.norm(offset)
    return given + offset if added else given
