"""Synthetic recordings: the repertoire's motions by people of other proportions and styles.

Each is written as a BVH or Acclaim file, for the importer to read like any other.
"""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from assets.recordings.written import ORDERS, Y_UP, write_acclaim, write_bvh
from assets.rotations import matrix_from_quaternion
from hrc_env.core.typing import Floats, Points3, Rotations
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.read import read_recording
from hrc_env.mocap.record import compose_tree
from hrc_env.mocap.retarget import RetargetError, retarget
from hrc_env.motion.clip import Clip
from hrc_env.motion.repertoire import REPERTOIRE, make_worker, perform
from hrc_env.worker.body import PARENT, SEGMENT, SEGMENTS, Body, load_body

FPS, LONGEST_S = 50.0, 8.0
LEGS, ARMS = ("thigh", "shank", "foot", "toes"), ("forearm", "hand")
"""Segments whose distance from their parent scales with the legs and with the arms."""


@dataclass(frozen=True, slots=True)
class Style:
    """A person with proportions and a style of their own."""

    name: str
    motion: str
    """Key of `REPERTOIRE`."""
    role: Literal["fitted", "validated"]
    body: str
    """Name of a baked worker."""
    legs: float = 1.0
    arms: float = 1.0
    trunk: float = 1.0
    """Lengths as shares of those of that body."""
    stoop_rad: float = 0.0
    """Additional forward inclination of the trunk."""
    apart_rad: float = 0.0
    """Additional angle of the upper arms from the trunk."""
    pace: float = 1.0
    """Factor on the speed of the motion."""


STYLES: tuple[Style, ...] = (
    Style("made-long-legs", "walk 1.1 m/s", "fitted", "worker_1", legs=1.15, pace=0.85),
    Style("made-short-legs", "walk 1.3 m/s", "fitted", "worker_2", legs=0.85, pace=1.15),
    Style("made-stooped", "walk 0.8 m/s", "fitted", "worker_3", stoop_rad=0.45),
    Style("made-arms-apart", "walk 1.1 m/s", "fitted", "worker_4", arms=1.1, apart_rad=0.4),
    Style("made-upright", "look round", "fitted", "worker_5", trunk=1.1, stoop_rad=-0.12),
    Style("made-long-arms", "point", "fitted", "worker_6", arms=1.2, trunk=0.92),
    Style("made-quick", "squat", "fitted", "worker_7", legs=0.9, pace=1.3),
    Style("made-slow", "kneel", "fitted", "worker_8", legs=1.1, pace=0.75),
    Style("made-hurried", "walk 1.4 m/s", "validated", "worker_6", legs=1.08, pace=1.15),
    Style("made-bent", "measure", "validated", "worker_7", arms=0.88, stoop_rad=0.3),
    Style("made-broad", "turn", "validated", "worker_8", trunk=1.08, apart_rad=0.55),
    Style("made-short", "lunge", "validated", "worker_5", legs=0.88, arms=0.92, pace=0.9),
)
"""Eight styles to fit on and four, of other motions, to validate on."""


def make_clips(
    role: Literal["fitted", "validated"] | None = None, body: Body | None = None
) -> Iterator[tuple[Style, Clip, RetargetError]]:
    """Yield each clip of a role (None: both), made for a body (None: worker_1), as `clips_of`
    does."""
    for number, style in enumerate(STYLES):
        if role in (None, style.role):
            with tempfile.TemporaryDirectory() as scratch:
                path = write(style, Path(scratch), number)
                capture = read_recording(path, source_fps=FPS * style.pace)
            clip, error = retarget(capture, body or load_body())
            yield style, replace(clip, source=style.name), error


def write(style: Style, folder: Path, number: int) -> Path:
    """Write the file of a style; formats, units, axes and orders of angles vary with the number."""
    body = load_body(style.body)
    films = perform(
        REPERTOIRE[style.motion], make_worker(body), np.random.default_rng(number), 1 / FPS
    )
    motions = [film.motion for film in films]
    places = np.concatenate([motion.position_world[:, 0] for motion in motions])
    turns = np.concatenate([motion.quaternion_wxyz[:, 0] for motion in motions])
    n = min(len(places), int(LONGEST_S * FPS * style.pace))
    position, rotation, person = restyle(places[:n], matrix_from_quaternion(turns[:n]), body, style)
    if number % 3 == 2:
        return write_acclaim(folder, position, rotation, person, style.name)
    unit_m, axes = (1.0, 0.01)[number % 2], (None, Y_UP)[number % 2]
    order = (ORDERS[number % len(ORDERS)],)
    path, fps = folder / f"{style.name}.bvh", FPS * style.pace
    return write_bvh(path, position, rotation, fps, unit_m, axes, order, body=person)


def restyle(
    position: Points3, rotation: Rotations, body: Body, style: Style
) -> tuple[Points3, Rotations, Body]:
    """Apply a style to a body's motion; supporting feet remain on the floor.

    Returns the segments' origins (T, 22, 3) and rotations (T, 22, 3, 3), and the body.
    """
    offset = body.rest_position - body.rest_position[np.maximum(PARENT, 0)]
    offset = offset * _lengths(style)[:, None]
    local = np.swapaxes(rotation[:, np.maximum(PARENT, 0)], -1, -2) @ rotation
    local[:, 0] = rotation[:, 0]
    bend = about_axis("y", style.stoop_rad)
    local[:, SEGMENT["abdomen"]] = local[:, SEGMENT["abdomen"]] @ bend
    for side, sign in (("left", 1.0), ("right", -1.0)):
        arm = SEGMENT[f"{side}_upper_arm"]
        local[:, arm] = about_axis("x", sign * style.apart_rad) @ local[:, arm]
    moving = np.repeat(offset[None], len(position), axis=0)
    moving[:, 0] = position[:, 0] * style.legs
    placed, turned = compose_tree(PARENT, moving, local)
    rest = _sum_offsets(offset, body.rest_position[0] * style.legs)
    return placed, turned, replace(body, rest_position=rest)


def _lengths(style: Style) -> Floats:
    """Return the share of each segment's distance from its parent, (22,)."""
    parts: Sequence[str] = [name.removeprefix("left_").removeprefix("right_") for name in SEGMENTS]
    return np.array(
        [style.legs if part in LEGS else style.arms if part in ARMS else style.trunk
         for part in parts]
    )  # fmt: skip


def _sum_offsets(offset: Points3, root: Floats) -> Points3:
    """Return origins at rest, (22, 3)."""
    rest = offset.copy()
    rest[0] = root
    for segment, above in enumerate(PARENT):
        if above >= 0:
            rest[segment] += rest[above]
    return rest
