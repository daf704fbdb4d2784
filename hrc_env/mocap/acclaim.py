"""Reader of Acclaim files, with skeletons (ASF) and motion (AMC) as in the CMU database.

The rotation of a bone in its parent's frame is C M C^-1. C rotates the axes of the file to those of
the bone ("axis" in the file). M is the rotation by the bone's degrees of freedom about fixed axes,
in the order of the file.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats, Ints, Rotations
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.record import FEWEST_FRAMES, Moving, compose_tree, place_at_rest
from hrc_env.mocap.rows import Rows

ROOT = "root"
FREEDOMS = ("tx", "ty", "tz", "rx", "ry", "rz")


@dataclass(slots=True)
class _Bone:
    """One bone of a skeleton; the direction of the root is zero."""

    direction: Floats = field(default_factory=lambda: np.zeros(3))
    """Direction (3,) from the bone's start to its end."""
    length: float = 1.0
    """Length of the bone [unit of the file]."""
    axis: Rotations = field(default_factory=lambda: np.eye(3))
    """Rotation (3, 3) from the axes of the bone to those of the file."""
    freedoms: tuple[str, ...] = ()
    """Degrees of freedom, in the order of the file."""

    @property
    def along(self) -> Floats:
        """Vector (3,) from the bone's start to its end [unit of the file]."""
        norm = float(np.linalg.norm(self.direction))
        return self.direction / norm * self.length if norm else np.zeros(3)


@dataclass(slots=True)
class _Skeleton:
    """Content of an ASF file."""

    bones: dict[str, _Bone] = field(default_factory=lambda: {ROOT: _Bone()})
    """Bones by name."""
    parent: dict[str, str] = field(default_factory=dict)
    """Name of each bone's parent."""
    per_inch: float = 1.0
    """Length of one inch in the unit of the file, 0.45 in the CMU database."""
    is_in_radians: bool = False
    """Whether angles are in radians instead of degrees."""


def read_acclaim(path: Path, skeleton: Path | None = None) -> Moving:
    """Read the motion in an AMC file and the skeleton in the matching ASF file.

    Args:
        path: path of the .amc file.
        skeleton: path of the .asf file; None to search for it in the folder of the .amc file.

    Raises:
        ConfigError: a file is missing, is damaged, or belongs to another skeleton.
    """
    if path.suffix.lower() == ".asf":
        raise ConfigError(f"{path.name} is a skeleton without motion; pass the .amc file instead.")
    skeleton = skeleton or _find_skeleton(path)
    ours, theirs = _read_subject(path), _read_subject(skeleton)
    if ours and theirs and ours != theirs:
        raise ConfigError(
            f"{path.name} is of subject {ours}, but {skeleton.name} is the skeleton of subject "
            f"{theirs}, whose bone lengths differ; expected {ours}.asf in the same folder or as "
            "--skeleton."
        )
    bones = _read_asf(skeleton)
    return _make_moving(bones, _read_amc(path, bones))


def _find_skeleton(path: Path) -> Path:
    """Return the ASF file that belongs to an AMC file, from the same folder.

    It has the same name or subject, or is the only ASF file.
    """
    beside = sorted(p for p in path.parent.iterdir() if p.suffix.lower() == ".asf")
    for stem in (path.stem, path.stem.split("_")[0]):
        for candidate in beside:
            if candidate.stem.lower() == stem.lower():
                return candidate
    if len(beside) == 1:
        return beside[0]
    raise ConfigError(
        f"{path.name} requires its skeleton, an .asf file, but its folder has no {path.stem}.asf. "
        f"Found there: {', '.join(p.name for p in beside) or 'none'}. Pass the skeleton with "
        "--skeleton."
    )


def _read_subject(path: Path) -> str:
    """Return the subject's number in the CMU database ("2" for 02.asf and 02_01.amc), or ""."""
    number = re.match(r"0*(\d+)(?=_|$)", path.stem)
    return number[1] if number else ""


def _read_asf(path: Path) -> _Skeleton:
    """Read the bones, hierarchy and units in an ASF file."""
    rows, skeleton, done = Rows(path), _Skeleton(), list[str]()
    bone, name = _Bone(), ""
    for words in rows.remaining():
        section, word = done[-1] if done else "", words[0]
        if word.startswith("#"):
            continue
        if word.startswith(":"):
            done.append(word[1:].lower())
        elif section == "units" and word == "length":
            (skeleton.per_inch,) = rows.to_numbers(words[1:2])
        elif section == "units" and word == "angle":
            skeleton.is_in_radians = words[1].startswith("rad")
        elif section == "root" and word == "order":
            skeleton.bones[ROOT].freedoms = tuple(freedom.lower() for freedom in words[1:])
        elif section == "bonedata" and word == "begin":
            bone, name = _Bone(), ""
        elif section == "bonedata" and word == "end":
            skeleton.bones[name] = bone
        elif section == "bonedata" and word == "name":
            name = words[1]
        elif section == "bonedata":
            _read_bone(words, bone, skeleton.is_in_radians, rows)
        elif section == "hierarchy" and word not in ("begin", "end"):
            skeleton.parent.update(dict.fromkeys(words[1:], word))
    _check_skeleton(skeleton, done, path.name)
    return skeleton


def _read_bone(words: list[str], bone: _Bone, is_in_radians: bool, rows: Rows) -> None:
    """Read one line of the definition of a bone; limits and masses are ignored.

    Args:
        words: words of the line.
        bone: bone to which the line belongs; it is changed.
        is_in_radians: whether angles are in radians.
        rows: lines of the file, for error messages.
    """
    if words[0] == "direction":
        bone.direction = np.array(rows.to_numbers(words[1:4]))
    elif words[0] == "length":
        (bone.length,) = rows.to_numbers(words[1:2])
    elif words[0] == "axis":
        angles = np.array(rows.to_numbers(words[1:4]))
        bone.axis = _compose_turns(
            tuple(f"r{axis}" for axis in words[4].lower()), angles[None], is_in_radians
        )[0]
    elif words[0] == "dof":
        bone.freedoms = tuple(word.lower() for word in words[1:])


def _check_skeleton(skeleton: _Skeleton, done: list[str], source: str) -> None:
    """Raise `ConfigError` if a skeleton is incomplete or has unknown degrees of freedom.

    Args:
        skeleton: content of the file.
        done: names of the sections of the file that were read.
        source: name of the file, for error messages.
    """
    missing = [part for part in ("units", "root", "bonedata", "hierarchy") if part not in done]
    if missing or not skeleton.parent:
        raise ConfigError(
            f"{source} is not a complete ASF skeleton: it lacks "
            f"{', '.join(':' + part for part in missing or ['hierarchy'])}."
        )
    strangers = sorted(set(skeleton.parent) - set(skeleton.bones))
    if strangers:
        raise ConfigError(f"{source}: its hierarchy contains bones without data: {strangers}.")
    for name, bone in skeleton.bones.items():
        if any(freedom not in FREEDOMS for freedom in bone.freedoms):
            raise ConfigError(
                f"{source}: bone {name!r} has degrees of freedom {bone.freedoms}; "
                f"expected some of {', '.join(FREEDOMS)}."
            )


class _Motion(NamedTuple):
    """Content of an AMC file."""

    values: dict[str, Floats]
    """Values (T, n_freedoms) of each moving bone, by name."""
    notes: tuple[str, ...]
    """Descriptions of the deviations from the format, one sentence each."""


def _read_amc(path: Path, skeleton: _Skeleton) -> _Motion:
    """Read the motion in an AMC file."""
    rows, frames = Rows(path), list[dict[str, list[float]]]()
    for words in rows.remaining():
        if words[0][0] in "#:":
            skeleton.is_in_radians = skeleton.is_in_radians or words[0] == ":RADIANS"
        elif len(words) == 1 and words[0].isdigit():
            frames.append({})
        elif not frames:
            raise ConfigError(
                f"{path.name} is not an AMC file: expected frame 1, got {words[0]!r}."
            )
        else:
            frames[-1][words[0]] = rows.to_numbers(words[1:])
    moving = {name: len(bone.freedoms) for name, bone in skeleton.bones.items() if bone.freedoms}
    if strangers := sorted(set().union(*frames) - set(skeleton.bones)):
        raise ConfigError(
            f"{path.name} belongs to another skeleton: it moves {', '.join(strangers)}; the bones "
            f"of this one are {', '.join(skeleton.bones)}."
        )
    whole = [f for f in frames if all(len(f.get(name, ())) == n for name, n in moving.items())]
    if len(whole) < FEWEST_FRAMES or whole != frames[: len(whole)] or len(frames) > len(whole) + 1:
        there = frames[0] if frames else {}
        wrong = [
            f"{name} has {len(there.get(name, ()))} numbers, not {n}"
            for name, n in moving.items()
            if len(there.get(name, ())) != n
        ]
        raise ConfigError(
            f"{path.name} is truncated or belongs to another skeleton: {len(whole)} of its "
            f"{len(frames)} frames have a number for each degree of freedom of every bone"
            + (f"; in the first frame, {', '.join(wrong)}." if wrong else ".")
        )
    values = {name: np.array([frame[name] for frame in whole]) for name in moving}
    cut = f"The last frame is truncated: the {len(whole)} frames before it are used."
    return _Motion(values, (cut,) if len(whole) < len(frames) else ())


def _make_moving(skeleton: _Skeleton, motion: _Motion) -> Moving:
    """Return the motion of nodes at the starts of bones and at the tips of chains, in inches."""
    (names, parent, along), values = _list_nodes(skeleton), motion.values
    offset = np.repeat(along[None] / skeleton.per_inch, len(values[ROOT]), axis=0)
    for column, freedom in enumerate(skeleton.bones[ROOT].freedoms):
        if freedom[0] == "t":
            axis = "xyz".index(freedom[1])
            offset[:, 0, axis] = values[ROOT][:, column] / skeleton.per_inch
    rotation = np.tile(np.eye(3), (*offset.shape[:2], 1, 1))
    for node, name in enumerate(names):
        if name in values:
            bone = skeleton.bones[name]
            turn = _compose_turns(bone.freedoms, values[name], skeleton.is_in_radians)
            rotation[:, node] = bone.axis @ turn @ bone.axis.T
    poses = compose_tree(parent, offset, rotation)
    rest = place_at_rest(parent, along / skeleton.per_inch)
    shift = np.zeros((len(offset), 3))
    return Moving(
        tuple(names),
        parent,
        poses.position,
        poses.rotation,
        rest,
        float("nan"),
        shift,
        motion.notes,
    )


class _Nodes(NamedTuple):
    """Bones and chain tips of a skeleton, with parents before their children."""

    names: list[str]
    """Name of each node."""
    parent: Ints
    """Parent (N,) of each node, -1 for the root."""
    along: Floats
    """Offset (N, 3) of each node in its parent's frame [unit of the file]."""


def _list_nodes(skeleton: _Skeleton) -> _Nodes:
    """Return the bones and chain tips of a skeleton, with parents before their children."""
    names, parent, along, tips = [ROOT], [-1], [np.zeros(3)], []
    for node, name in enumerate(names):  # the list grows during the iteration
        children = [child for child, above in skeleton.parent.items() if above == name]
        names += children
        parent += [node] * len(children)
        along += [skeleton.bones[name].along] * len(children)
        if not children:
            tips.append(node)
    parent += tips
    along += [skeleton.bones[names[node]].along for node in tips]
    names += [f"{names[node]} end" for node in tips]
    return _Nodes(names, np.array(parent), np.array(along))


def _compose_turns(freedoms: tuple[str, ...], values: Floats, is_in_radians: bool) -> Rotations:
    """Compose the rotations (T, 3, 3) about fixed axes, in the order of application.

    Args:
        freedoms: degrees of freedom; translations are ignored.
        values: values (T, n_freedoms) of the degrees of freedom.
        is_in_radians: whether angles are in radians.
    """
    turned = np.tile(np.eye(3), (len(values), 1, 1))
    for freedom, value in zip(freedoms, values.T, strict=True):
        if freedom[0] == "r":
            turned = about_axis(freedom[1], value if is_in_radians else np.radians(value)) @ turned
    return turned
