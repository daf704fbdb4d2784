"""Acclaim: a skeleton (ASF) and its motion (AMC), as the CMU database has them.

A bone's rotation is C M C^-1 in its parent's frame: C turns the file's axes to the bone's own
("axis"), M is what a frame says of its degrees of freedom. Rotations are about fixed axes in
the order in which they are written.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats, Ints, Rotations
from hrc_env.geometry.rotations import about_axis
from hrc_env.motion.capture.record import Moving, forward
from hrc_env.motion.capture.rows import FEWEST_FRAMES, Rows, number

ROOT = "root"
FREEDOMS = ("tx", "ty", "tz", "rx", "ry", "rz")


@dataclass(slots=True)
class _Bone:
    """One bone of a skeleton; the root has no length."""

    along: Floats = field(default_factory=lambda: np.zeros(3))
    """(3,) from its start to its end [unit of the file]."""
    axis: Rotations = field(default_factory=lambda: np.eye(3))
    freedoms: tuple[str, ...] = ()


@dataclass(slots=True)
class _Skeleton:
    """An ASF file."""

    bones: dict[str, _Bone]
    parent: dict[str, str]
    per_inch: float
    """Lengths of the file in an inch (CMU: 0.45)."""
    radians: bool


def read_acclaim(path: Path, skeleton: Path | None = None) -> Moving:
    """An AMC file's motion of the skeleton in its ASF file.

    Raises:
        ConfigError: no skeleton, a file that is none of these, or one that is cut off.
    """
    if path.suffix.lower() == ".asf":
        raise ConfigError(f"{path.name} is a skeleton without motion; give its .amc file.")
    bones = _read_asf(skeleton or _skeleton_of(path))
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


def _read_asf(path: Path) -> _Skeleton:
    """Bones, who hangs on whom, units."""
    rows = Rows(path)
    skeleton = _Skeleton({ROOT: _Bone()}, {}, 1.0, False)
    section, bone, name = "", _Bone(), ""
    done: set[str] = set()
    for words in rows.rest():
        if words[0].startswith("#"):
            continue
        if words[0].startswith(":"):
            section = words[0][1:].lower()
            done.add(section)
        elif section == "units":
            _read_unit(words, skeleton, rows)
        elif section == "root" and words[0] == "order":
            skeleton.bones[ROOT].freedoms = tuple(word.lower() for word in words[1:])
        elif section == "bonedata":
            if words[0] == "begin":
                bone, name = _Bone(), ""
            elif words[0] == "end":
                skeleton.bones[name] = bone
            elif words[0] == "name":
                name = words[1]
            else:
                _read_bone(words, bone, skeleton.radians, rows)
        elif section == "hierarchy" and words[0] not in ("begin", "end"):
            skeleton.parent.update(dict.fromkeys(words[1:], words[0]))
    return _checked(skeleton, done, path.name)


def _read_unit(words: list[str], skeleton: _Skeleton, rows: Rows) -> None:
    if words[0] == "length":
        skeleton.per_inch = number(words[1], rows)
    elif words[0] == "angle":
        skeleton.radians = words[1].startswith("rad")


def _read_bone(words: list[str], bone: _Bone, radians: bool, rows: Rows) -> None:
    """One line of a bone; what the kinematics do not need (limits, masses) is passed over."""
    if words[0] == "direction":
        vector = np.array([number(word, rows) for word in words[1:4]])
        bone.along = vector * (_norm(bone.along) or 1.0)
    elif words[0] == "length":
        length, norm = number(words[1], rows), _norm(bone.along)
        bone.along = bone.along / norm * length if norm else np.array([length, 0.0, 0.0])
    elif words[0] == "axis":
        angles = np.array([number(word, rows) for word in words[1:4]])
        bone.axis = _turn(tuple(f"r{axis}" for axis in words[4].lower()), angles[None], radians)[0]
    elif words[0] == "dof":
        bone.freedoms = tuple(word.lower() for word in words[1:])


def _norm(vector: Floats) -> float:
    return float(np.linalg.norm(vector))


def _checked(skeleton: _Skeleton, done: set[str], source: str) -> _Skeleton:
    """The skeleton, if it is whole.

    Raises:
        ConfigError: a part is missing, or a bone moves in a way that no file of people does.
    """
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
    return skeleton


def _read_amc(path: Path, skeleton: _Skeleton) -> tuple[dict[str, Floats], tuple[str, ...]]:
    """(T, freedoms) of every bone that moves."""
    rows = Rows(path)
    frames: list[dict[str, list[float]]] = []
    for words in rows.rest():
        if words[0][0] in "#:":
            skeleton.radians = skeleton.radians or words[0] == ":RADIANS"
        elif len(words) == 1 and words[0].isdigit():
            frames.append({})
        elif not frames:
            raise ConfigError(f"{path.name} is no AMC file: expected frame 1, got {words[0]!r}.")
        else:
            frames[-1][words[0]] = [number(word, rows) for word in words[1:]]
    moving = {name: len(bone.freedoms) for name, bone in skeleton.bones.items() if bone.freedoms}
    whole = [f for f in frames if all(len(f.get(name, ())) == n for name, n in moving.items())]
    if len(whole) < FEWEST_FRAMES or whole != frames[: len(whole)] or len(frames) > len(whole) + 1:
        lacks = [n for n in moving if frames and n not in frames[0]]
        raise ConfigError(
            f"{path.name} is cut off or belongs to another skeleton: {len(whole)} of its "
            f"{len(frames)} frames name every bone that moves"
            + (f"; missing in the first: {', '.join(lacks)}." if lacks else ".")
        )
    values = {name: np.array([frame[name] for frame in whole]) for name in moving}
    cut = f"The last frame is cut off: {len(whole)} are used."
    return values, (cut,) if len(whole) < len(frames) else ()


def _moving(skeleton: _Skeleton, values: dict[str, Floats], repaired: tuple[str, ...]) -> Moving:
    """Every bone as a node at its start, and the tips of the chains, in inches."""
    names, parent, along = _tree(skeleton)
    n_frames = len(values[ROOT])
    offset = np.repeat(along[None] / skeleton.per_inch, n_frames, axis=0)
    for column, freedom in enumerate(skeleton.bones[ROOT].freedoms):
        if freedom[0] == "t":
            axis = "xyz".index(freedom[1])
            offset[:, 0, axis] = values[ROOT][:, column] / skeleton.per_inch
    still = np.repeat(np.eye(3)[None], len(names), axis=0)
    rotation = np.repeat(still[None], n_frames, axis=0)
    for node, name in enumerate(names):
        if name in values:
            rotation[:, node] = _local(skeleton.bones[name], values[name], skeleton.radians)
    position, turned = forward(parent, offset, rotation)
    rest, _ = forward(parent, along[None] / skeleton.per_inch, still[None])
    return Moving(tuple(names), position, turned, rest[0], float("nan"), repaired)


def _tree(skeleton: _Skeleton) -> tuple[list[str], Ints, Floats]:
    """Names, parents and offsets (N, 3) in the parent's frame of bones and tips, parents first."""
    names, parent, along, tips = [ROOT], [-1], [np.zeros(3)], []
    for node, name in enumerate(names):  # grows while it is read
        children = [child for child, above in skeleton.parent.items() if above == name]
        for child in children:
            names.append(child)
            parent.append(node)
            along.append(skeleton.bones[name].along)
        if not children:
            tips.append(node)
    for node in tips:
        parent.append(node)
        along.append(skeleton.bones[names[node]].along)
    names += [f"{names[node]} end" for node in tips]
    return names, np.array(parent), np.array(along)


def _local(bone: _Bone, values: Floats, radians: bool) -> Rotations:
    """(T, 3, 3) parent_from_bone."""
    return bone.axis @ _turn(bone.freedoms, values, radians) @ bone.axis.T


def _turn(freedoms: tuple[str, ...], values: Floats, radians: bool) -> Rotations:
    """(T, 3, 3) turns about fixed axes, the first written is done first."""
    turned = np.repeat(np.eye(3)[None], len(values), axis=0)
    for freedom, value in zip(freedoms, values.T, strict=True):
        if freedom[0] == "r":
            turned = about_axis(freedom[1], value if radians else np.radians(value)) @ turned
    return turned
