"""What the robot sees: one declaration per observation term.

The space, the environment's page, `split` and the tests all derive from the terms, so that
they cannot drift apart. Terms read the *estimate* of the worker, never the truth.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.belief import (
    Belief,
    covariance_factor_m,
    deviation_towards_robot_m,
    lent_belief,
    standard_deviation_m,
)
from hrc_env.core.brought import check_arguments
from hrc_env.core.errors import check_shape, needed
from hrc_env.core.kernels import kernel
from hrc_env.core.lending import called, is_of_user
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.records import HandState, ObjectState
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Tensor
from hrc_env.geometry.rotations import matrix

TOWARDS_ROBOT, FACTOR = UNCERTAINTY = ("towards_robot", "factor")
"""What else can be asked for of each joint's covariance."""
FLAT = "observation"
"""Name of the flat observation where goals or images stand beside it."""
IMAGE = "image_"
"""How the names of images begin that stand beside it; the camera's name follows."""
FAR_SEPARATION_M = 1.0
"""Larger separations are reported as this: nothing near, or nobody known of."""


@dataclass(frozen=True, slots=True)
class Sizes:
    """What the lengths of terms depend on."""

    arm_joints: int
    """Hinges."""
    actions: int
    workers: int
    horizons: int = 0
    """How many times ahead were asked for."""
    uncertainty: tuple[str, ...] = ()
    """Which of `UNCERTAINTY` were asked for."""
    hands: int = 0
    """1 of an arm that can hold something,"""
    fingers: int = 0
    """and 1 if with fingers."""
    objects: int = 0
    """How many are loose."""
    slides: int = 0
    """Of the robot's joints."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class ObservationTerm:
    """One block of the flat observation: clip(function, -bound, bound) / scale."""

    name: str
    """By which `split_observation` and the environment's page know it."""
    size: int | Callable[[Sizes], int]
    """Number of entries, or a function of what it depends on."""
    unit: str
    """Of what the function returns: "m", "rad", ..., or "-"."""
    frame: str
    """In which vectors are given: "world", "base", ..., or "-"."""
    bound: float
    """Largest magnitude, in `unit`; larger values are clipped."""
    scale: float
    """What one unit of the observation stands for, in `unit`."""
    doc: str
    """A sentence for the environment's page."""
    function: Callable[[Belief], Floats]
    """Belief -> (B, ...), flattened per environment; not asked where it has no entries."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for a function that does not take one argument."""
        check_arguments(f"The observation term {self.name!r}", self.function, "belief")


def _nearest_direction(now: Belief) -> Floats:
    to_worker = now.separation.point_b_world - now.separation.point_a_world
    near = now.separation.distance_m < FAR_SEPARATION_M
    return np.where(near[..., None], directions(to_worker, 1e-3), 0.0)


def directions(vectors: Floats, softening: float) -> Floats:
    """Vectors (..., 3) divided by their length plus a little: unit vectors, but 0 stays 0."""
    shortened = np.array(vectors)
    _shorten(shortened.reshape(-1, 3), softening)
    return shortened


@kernel
def _shorten(vectors, softening):
    for k in range(len(vectors)):
        x, y, z = vectors[k]
        divisor = math.sqrt(x * x + y * y + z * z) + softening
        for i in range(3):
            vectors[k, i] /= divisor


def _hinges(now: Belief, values: Floats) -> Floats:
    """Those of values (B, N) of the robot's joints that are of hinges."""
    return values if now.robot.slides is None else values[:, ~now.robot.slides]


def _slides(now: Belief, values: Floats) -> Floats:
    """Those that are of slides."""
    return values[:, needed(now.robot.slides, "A slide")]


def _hand(now: Belief) -> HandState:
    return needed(now.hand, "A hand")


def _objects(now: Belief) -> ObjectState:
    return needed(now.objects, "A loose object")


def _joints_forecast(now: Belief) -> Floats:
    """(B, W, H, J, 3) from the tool point now."""
    joints = np.stack([later.mean_world for later in now.forecast], axis=2)
    return joints - now.robot.tool_world[:, None, None, None]


ROBOT_TERMS: tuple[ObservationTerm, ...] = (
    ObservationTerm(
        "joint_angle_sin", lambda of: of.arm_joints, "-", "base", 1.0, 1.0,
        "Sine of each arm joint's angle.",
        lambda now: np.sin(_hinges(now, now.robot.q)),
    ),
    ObservationTerm(
        "joint_angle_cos", lambda of: of.arm_joints, "-", "base", 1.0, 1.0,
        "Cosine of each arm joint's angle.",
        lambda now: np.cos(_hinges(now, now.robot.q)),
    ),
    ObservationTerm(
        "joint_velocity", lambda of: of.arm_joints, "rad/s", "base", 4.0, 1.0,
        "Velocity of each arm joint.",
        lambda now: _hinges(now, now.robot.qd),
    ),
    ObservationTerm(
        "tool_position", lambda of: 3, "m", "world", 4.0, 1.0,
        "Position of the tool point.",
        lambda now: now.robot.tool_world,
    ),
    ObservationTerm(
        "tool_axes", lambda of: 6 * of.hands, "-", "world", 1.0, 1.0,
        "The tool's x axis, along which fingers move, and its z axis, away from the arm.",
        lambda now: now.robot.tool_axes_world[..., [0, 2]].swapaxes(-1, -2),
    ),
    ObservationTerm(
        "hand_opening", lambda of: of.fingers, "m", "tool", 0.2, 0.05,
        "How far each finger is from the middle.",
        lambda now: _hand(now).opening_m,
    ),
    ObservationTerm(
        "hand_force", lambda of: of.hands, "N", "tool", 300.0, 100.0,
        "With which the fingers press together, negative: apart; or what hangs on the cups.",
        lambda now: _hand(now).force_n,
    ),
    ObservationTerm(
        "object_from_tool", lambda of: 3 * of.objects, "m", "world", 3.0, 0.5,
        "From the tool point to the middle of each loose object, as measured.",
        lambda now: _objects(now).position_world - now.robot.tool_world[:, None],
    ),
    ObservationTerm(
        "object_axes", lambda of: 6 * of.objects, "-", "world", 1.0, 1.0,
        "Each object's y axis and z axis, as measured.",
        lambda now: matrix(_objects(now).quaternion_wxyz)[..., 1:].swapaxes(-1, -2),
    ),
    ObservationTerm(
        "object_held", lambda of: of.objects, "-", "-", 1.0, 1.0,
        "1 for an object that the fingers hold.",
        lambda now: _objects(now).held.astype(float),
    ),
)  # fmt: skip
"""The robot's own state and what it handles, which open the observation."""

SLIDE_TERMS: tuple[ObservationTerm, ...] = (
    ObservationTerm(
        "slide_position", lambda of: of.slides, "m", "world", 10.0, 5.0,
        "Where each slide is: of a base that drives, x and y of its middle.",
        lambda now: _slides(now, now.robot.q),
    ),
    ObservationTerm(
        "slide_velocity", lambda of: of.slides, "m/s", "world", 4.0, 1.0,
        "Velocity of each slide.",
        lambda now: _slides(now, now.robot.qd),
    ),
)  # fmt: skip
"""What follows of a robot that drives."""

SHARED_TERMS: tuple[ObservationTerm, ...] = (
    ObservationTerm(
        "last_action", lambda of: of.actions, "-", "-", 1.0, 1.0,
        "The action of the previous step, as it was wanted, whatever a shield made of it.",
        lambda now: now.action,
    ),
    ObservationTerm(
        "worker_joints_from_tool", lambda of: of.workers * N_JOINTS * 3, "m", "world", 6.0, 1.0,
        "From the tool point to each estimated joint of each worker.",
        lambda now: now.estimate.mean_world - now.robot.tool_world[:, None, None],
    ),
    ObservationTerm(
        "worker_joints_std", lambda of: of.workers * N_JOINTS, "m", "world", 1.0, 0.25,
        "Standard deviation of each estimated joint (root mean over the axes).",
        lambda now: standard_deviation_m(now.estimate),
    ),
    ObservationTerm(
        "worker_joints_age", lambda of: of.workers * N_JOINTS, "s", "-", 2.0, 1.0,
        "Time since a measurement last supported each joint.",
        lambda now: now.estimate.age_s,
    ),
    ObservationTerm(
        "worker_joints_velocity", lambda of: of.workers * N_JOINTS * 3, "m/s", "world", 4.0, 2.0,
        "Estimated velocity of each joint.",
        lambda now: now.estimate.velocity_world,
    ),
    ObservationTerm(
        "worker_tracked", lambda of: of.workers, "-", "-", 1.0, 1.0,
        "1 while there is a track of the worker, 0 where the estimate is the prior or lost.",
        lambda now: now.estimate.tracked.astype(float),
    ),
    ObservationTerm(
        "worker_unknown", lambda of: of.workers, "-", "-", 1.0, 1.0,
        "1 while somebody without a track may be near: lost, or on floor not seen empty.",
        lambda now: now.estimate.unknown.astype(float),
    ),
    ObservationTerm(
        "worker_blind", lambda of: of.workers, "s", "-", 5.0, 2.5,
        "Time since cameras last saw the worker, or that nobody is there.",
        lambda now: now.estimate.blind_s,
    ),
    ObservationTerm(
        "worker_separation", lambda of: of.workers, "m", "-", FAR_SEPARATION_M, 0.5,
        "Distance between the robot's surface and the estimated body's, at most 1 m.",
        lambda now: np.minimum(now.separation.distance_m, FAR_SEPARATION_M),
    ),
    ObservationTerm(
        "worker_direction", lambda of: of.workers * 3, "-", "world", 1.0, 1.0,
        "Unit vector from the robot to the estimated body where they are nearest; 0 if far.",
        _nearest_direction,
    ),
    ObservationTerm(
        "worker_joints_forecast", lambda of: of.workers * of.horizons * N_JOINTS * 3,
        "m", "world", 6.0, 1.0,
        "From the tool point now to where each joint will be, for each of `forecast_s`.",
        _joints_forecast,
    ),
    ObservationTerm(
        "worker_joints_forecast_std", lambda of: of.workers * of.horizons * N_JOINTS,
        "m", "world", 1.0, 0.25,
        "Standard deviation of each of these (root mean over the axes).",
        lambda now: np.stack([standard_deviation_m(later) for later in now.forecast], axis=2),
    ),
    ObservationTerm(
        "worker_joints_std_towards_robot",
        lambda of: of.workers * N_JOINTS * (TOWARDS_ROBOT in of.uncertainty),
        "m", "-", 1.0, 0.25,
        "Standard deviation of each joint along the line to the nearest point of the robot.",
        lambda now: deviation_towards_robot_m(now.robot, now.estimate),
    ),
    ObservationTerm(
        "worker_joints_factor",
        lambda of: of.workers * N_JOINTS * 6 * (FACTOR in of.uncertainty),
        "m", "world", 1.0, 0.25,
        "Cholesky factor L of each joint's covariance L L': xx, yx, yy, zx, zy, zz.",
        lambda now: covariance_factor_m(now.estimate),
    ),
)  # fmt: skip
"""What closes it: the last action, and the workers as they are estimated."""

SHIELD_TERMS: tuple[ObservationTerm, ...] = (
    ObservationTerm(
        "shield_change", lambda of: of.arm_joints + of.slides, "rad/s", "base", 4.0, 1.0,
        "Joint velocities that the shield gave in the previous step, less those asked for.",
        lambda now: needed(now.shield_change, "What the shield changed"),
    ),
)  # fmt: skip
"""What is added with `HRCConfig.observe_shield`."""


@dataclass(frozen=True, slots=True)
class ObservationLayout:
    """Which entries of the flat observation belong to which term."""

    terms: tuple[int, ...]
    """Which of all terms have entries, in their order."""
    slices: dict[str, slice]
    """Of every term."""
    low: Tensor
    high: Tensor
    scale: Floats
    """(n,) what one unit of each entry stands for, in the term's unit."""


def layout(terms: tuple[ObservationTerm, ...], of: Sizes) -> ObservationLayout:
    """The layout of terms for an arm, an action space, a number of workers and of times ahead."""
    sizes = [term.size if isinstance(term.size, int) else term.size(of) for term in terms]
    ends = np.cumsum(sizes).tolist()
    slices = {t.name: slice(end - n, end) for t, n, end in zip(terms, sizes, ends, strict=True)}
    bound = np.repeat([term.bound / term.scale for term in terms], sizes).astype(np.float32)
    scale = np.repeat([term.scale for term in terms], sizes)
    present = tuple(np.flatnonzero(sizes).tolist())
    return ObservationLayout(present, slices, -bound, bound, scale)


def observe(now: Belief, where: ObservationLayout, terms: tuple[ObservationTerm, ...]) -> Tensor:
    """(B, n) flat observations of `terms`; `ConfigError` for one with other entries than it says,
    `FloatingPointError` for one that is no number, a fault of the code, never of a camera."""
    batch = len(now.action)
    present = [terms[k] for k in where.terms]
    values = [_value(term, now) for term in present]
    for term, value in zip(present, values, strict=True):
        name, rows = f"rows of observation term {term.name!r}", np.shape(value)[:1]
        check_shape(name, rows, (batch,), "one an environment")
    parts = [value.reshape(batch, -1) for value in values]
    physical = np.concatenate(parts, axis=1)
    if physical.shape[1] != len(where.scale):
        for term, part in zip(present, parts, strict=True):
            size = where.slices[term.name].stop - where.slices[term.name].start
            check_shape(f"observation term {term.name!r}", part.shape[1:], (size,), "its `size`")
    observation = np.empty(physical.shape, np.float32)
    if not _scale(physical, where.scale, where.low, where.high, observation):
        names = [name for name, part in where.slices.items() if np.isnan(physical[:, part]).any()]
        raise FloatingPointError(f"Observation terms that are not a number: {', '.join(names)}.")
    return observation


def _value(term: ObservationTerm, now: Belief) -> Floats:
    """The value (B, ...) of a term; one of users is given a read-only belief."""
    if is_of_user(term.function):
        return called(f"Observation term {term.name!r}", term.function, lent_belief(now))
    return term.function(now)


@kernel
def _scale(physical: Floats, scale: Floats, low: Tensor, high: Tensor, observation: Tensor) -> bool:
    """Entries (B, n) in units to clipped ones in units of `scale`; whether all are numbers."""
    numbers = True
    for b in range(physical.shape[0]):
        for i in range(physical.shape[1]):
            value = np.float32(physical[b, i] / scale[i])
            numbers &= value == value
            observation[b, i] = min(max(value, low[i]), high[i])
    return numbers


def split(
    observation: Tensor | Mapping[str, Tensor], where: ObservationLayout
) -> dict[str, Floats]:
    """A flat observation (..., n) as named terms in their units; goals and images beside it as they
    are."""
    if isinstance(observation, Mapping):
        beside: dict[str, Any] = {
            name: part if name.startswith(IMAGE) else np.asarray(part, float)
            for name, part in observation.items()
            if name != FLAT
        }
        return {**split(observation[FLAT], where), **beside}
    physical = observation * where.scale
    return {name: physical[..., part] for name, part in where.slices.items()}
