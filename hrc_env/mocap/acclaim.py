"""Acclaim: a skeleton (ASF) and its motion (AMC), as the CMU database has them.

A bone's rotation is C M C^-1 in its parent's frame: C turns the file's axes to the bone's own
("axis"), M is of its degrees of freedom; about fixed axes in the order in which they are written.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats, Ints, Rotations
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.record import FEWEST_FRAMES, Moving, at_rest, forward
from hrc_env.mocap.rows import Rows

ROOT = "root"
FREEDOMS = ("tx", "ty", "tz", "rx", "ry", "rz")


@dataclass(slots=True)
class _Bone:
    """One bone of a skeleton; the root has no length."""

    direction: Floats = field(default_factory=lambda: np.zeros(3))
    length: float = 1.0
    """From its start to its end [unit of the file]."""
    axis: Rotations = field(default_factory=lambda: np.eye(3))
    freedoms: tuple[str, ...] = ()

    @property
    def along(self) -> Floats:
        """(3,) from its start to its end [unit of the file]."""
        norm = float(np.linalg.norm(self.direction))
        return self.direction / norm * self.length if norm else np.zeros(3)


@dataclass(slots=True)
class _Skeleton:
    """An ASF file."""

    bones: dict[str, _Bone] = field(default_factory=lambda: {ROOT: _Bone()})
    parent: dict[str, str] = field(default_factory=dict)
    per_inch: float = 1.0
    """Lengths of the file in an inch (CMU: 0.45)."""
    radians: bool = False


def read_acclaim(path: Path, skeleton: Path | None = None) -> Moving:
    """An AMC file's motion of the skeleton in its ASF file; `ConfigError` where one is damaged."""
    if path.suffix.lower() == ".asf":
        raise ConfigError(f"{path.name} is a skeleton without motion; give its .amc file.")
    found = skeleton or _skeleton_of(path)
    ours, theirs = _subject(path), _subject(found)
    if ours and theirs and ours != theirs:
        raise ConfigError(
            f"{path.name} is of subject {ours}, {found.name} the skeleton of subject {theirs}, "
            f"whose bones have other lengths; expected {ours}.asf beside it or as --skeleton."
        )
    bones = _read_asf(found)
    values, repaired = _read_amc(path, bones)
    return _moving(bones, values, repaired)


def _skeleton_of(path: Path) -> Path:
    """The ASF file beside an AMC file: of its name, its subject (02_01.amc: 02.asf), or alone."""
    beside = sorted(p for p in path.parent.iterdir() if p.suffix.lower() == ".asf")
    for stem in (path.stem, path.stem.split("_")[0]):
        for candidate in beside:
            if candidate.stem.lower() == stem.lower():
                return candidate
    if len(beside) == 1:
        return beside[0]
    raise ConfigError(
        f"{path.name} needs its skeleton, an .asf file: none beside it is called "
        f"{path.stem}.asf. Found there: {', '.join(p.name for p in beside) or 'none'}. "
        "Give it with --skeleton."
    )


def _subject(path: Path) -> str:
    """The subject's number, as the CMU database has it: 2 for 02.asf and 02_01.amc; or nothing."""
    number = re.match(r"0*(\d+)(?=_|$)", path.stem)
    return number[1] if number else ""


def _read_asf(path: Path) -> _Skeleton:
    """Bones, who hangs on whom, units."""
    rows, skeleton, done = Rows(path), _Skeleton(), list[str]()
    bone, name = _Bone(), ""
    for words in rows.rest():
        section, word = done[-1] if done else "", words[0]
        if word.startswith("#"):
            continue
        if word.startswith(":"):
            done.append(word[1:].lower())
        elif section == "units" and word == "length":
            (skeleton.per_inch,) = rows.numbers(words[1:2])
        elif section == "units" and word == "angle":
            skeleton.radians = words[1].startswith("rad")
        elif section == "root" and word == "order":
            skeleton.bones[ROOT].freedoms = tuple(each.lower() for each in words[1:])
        elif section == "bonedata" and word == "begin":
            bone, name = _Bone(), ""
        elif section == "bonedata" and word == "end":
            skeleton.bones[name] = bone
        elif section == "bonedata" and word == "name":
            name = words[1]
        elif section == "bonedata":
            _read_bone(words, bone, skeleton.radians, rows)
        elif section == "hierarchy" and word not in ("begin", "end"):
            skeleton.parent.update(dict.fromkeys(words[1:], word))
    _check(skeleton, done, path.name)
    return skeleton


def _read_bone(words: list[str], bone: _Bone, radians: bool, rows: Rows) -> None:
    """One line of a bone; what the kinematics do not need (limits, masses) is passed over."""
    if words[0] == "direction":
        bone.direction = np.array(rows.numbers(words[1:4]))
    elif words[0] == "length":
        (bone.length,) = rows.numbers(words[1:2])
    elif words[0] == "axis":
        angles = np.array(rows.numbers(words[1:4]))
        bone.axis = _turn(tuple(f"r{axis}" for axis in words[4].lower()), angles[None], radians)[0]
    elif words[0] == "dof":
        bone.freedoms = tuple(word.lower() for word in words[1:])


def _check(skeleton: _Skeleton, done: list[str], source: str) -> None:
    """Refuse a skeleton that lacks a part, or moves in a way that no file of people does."""
    missing = [part for part in ("units", "root", "bonedata", "hierarchy") if part not in done]
    if missing or not skeleton.parent:
        raise ConfigError(
            f"{source} is no whole ASF skeleton: it lacks "
            f"{', '.join(':' + part for part in missing or ['hierarchy'])}."
        )
    strangers = sorted(set(skeleton.parent) - set(skeleton.bones))
    if strangers:
        raise ConfigError(f"{source}: its hierarchy names bones without data: {strangers}.")
    for name, bone in skeleton.bones.items():
        if any(freedom not in FREEDOMS for freedom in bone.freedoms):
            raise ConfigError(
                f"{source}: bone {name!r} has degrees of freedom {bone.freedoms}; "
                f"expected some of {', '.join(FREEDOMS)}."
            )


def _read_amc(path: Path, skeleton: _Skeleton) -> tuple[dict[str, Floats], tuple[str, ...]]:
    """(T, freedoms) of every bone that moves."""
    rows, frames = Rows(path), list[dict[str, list[float]]]()
    for words in rows.rest():
        if words[0][0] in "#:":
            skeleton.radians = skeleton.radians or words[0] == ":RADIANS"
        elif len(words) == 1 and words[0].isdigit():
            frames.append({})
        elif not frames:
            raise ConfigError(f"{path.name} is no AMC file: expected frame 1, got {words[0]!r}.")
        else:
            frames[-1][words[0]] = rows.numbers(words[1:])
    moving = {name: len(bone.freedoms) for name, bone in skeleton.bones.items() if bone.freedoms}
    if strangers := sorted(set().union(*frames) - set(skeleton.bones)):
        raise ConfigError(
            f"{path.name} belongs to another skeleton: it moves {', '.join(strangers)}; this one "
            f"has {', '.join(skeleton.bones)}."
        )
    whole = [f for f in frames if all(len(f.get(name, ())) == n for name, n in moving.items())]
    if len(whole) < FEWEST_FRAMES or whole != frames[: len(whole)] or len(frames) > len(whole) + 1:
        there = frames[0] if frames else {}
        wrong = [
            f"{name} has {len(there.get(name, ()))} numbers, not {n}"
            for name, n in moving.items() if len(there.get(name, ())) != n
        ]  # fmt: skip
        raise ConfigError(
            f"{path.name} is cut off or belongs to another skeleton: {len(whole)} of its "
            f"{len(frames)} frames have a number for each freedom of every bone"
            + (f"; in the first, {', '.join(wrong)}." if wrong else ".")
        )
    values = {name: np.array([frame[name] for frame in whole]) for name in moving}
    cut = f"The last frame is cut off: {len(whole)} are used."
    return values, (cut,) if len(whole) < len(frames) else ()


def _moving(skeleton: _Skeleton, values: dict[str, Floats], repaired: tuple[str, ...]) -> Moving:
    """Every bone as a node at its start, and the tips of the chains, in inches."""
    names, parent, along = _tree(skeleton)
    offset = np.repeat(along[None] / skeleton.per_inch, len(values[ROOT]), axis=0)
    for column, freedom in enumerate(skeleton.bones[ROOT].freedoms):
        if freedom[0] == "t":
            axis = "xyz".index(freedom[1])
            offset[:, 0, axis] = values[ROOT][:, column] / skeleton.per_inch
    rotation = np.tile(np.eye(3), (*offset.shape[:2], 1, 1))
    for node, name in enumerate(names):
        if name in values:
            bone = skeleton.bones[name]
            turn = _turn(bone.freedoms, values[name], skeleton.radians)
            rotation[:, node] = bone.axis @ turn @ bone.axis.T
    position, turned = forward(parent, offset, rotation)
    rest = at_rest(parent, along / skeleton.per_inch)
    shift = np.zeros((len(offset), 3))
    return Moving(tuple(names), parent, position, turned, rest, float("nan"), shift, repaired)


def _tree(skeleton: _Skeleton) -> tuple[list[str], Ints, Floats]:
    """Names, parents and offsets (N, 3) in the parent's frame of bones and tips, parents first."""
    names, parent, along, tips = [ROOT], [-1], [np.zeros(3)], []
    for node, name in enumerate(names):  # grows while it is read
        children = [child for child, above in skeleton.parent.items() if above == name]
        names += children
        parent += [node] * len(children)
        along += [skeleton.bones[name].along] * len(children)
        if not children:
            tips.append(node)
    parent += tips
    along += [skeleton.bones[names[node]].along for node in tips]
    return names + [f"{names[node]} end" for node in tips], np.array(parent), np.array(along)


def _turn(freedoms: tuple[str, ...], values: Floats, radians: bool) -> Rotations:
    """(T, 3, 3) turns about fixed axes, the first written is done first."""
    turned = np.tile(np.eye(3), (len(values), 1, 1))
    for freedom, value in zip(freedoms, values.T, strict=True):
        if freedom[0] == "r":
            turned = about_axis(freedom[1], value if radians else np.radians(value)) @ turned
    return turned
