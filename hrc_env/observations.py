"""The observation of an environment, which is composed of declared terms.

The observation space, the documentation of the environments, `split` and the tests are derived from
these declarations and are therefore consistent. Terms read the *estimate* of the workers, never the
truth.
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
    lend_belief,
    standard_deviation_m,
)
from hrc_env.core.brought import check_arguments
from hrc_env.core.errors import check_shape, require
from hrc_env.core.kernels import kernel
from hrc_env.core.lending import call_user_function, is_of_user
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.records import HandState, ObjectState
from hrc_env.core.renamed_keys import RenamedKeys
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Tensor
from hrc_env.geometry.rotations import matrix

TOWARDS_ROBOT, FACTOR = UNCERTAINTY = ("towards_robot", "factor")
"""Valid values of `HRCConfig.uncertainty`: additional measures of each joint's covariance."""
FLAT = "observation"
"""Key of the flat observation in an observation dictionary with goals or images."""
IMAGE = "image_"
"""Prefix of the keys of images in an observation dictionary, followed by the camera's name."""
RENAMED = {
    "way_direction": "path_direction",
    "way_left": "remaining_path",
    "worker_blind": "worker_unobserved_time",
}
"""Current names of renamed observation terms, by their former names."""
FAR_SEPARATION_M = 1.0
"""Largest separation in the observation, also used for workers without a track [m]."""


@dataclass(frozen=True, slots=True)
class Sizes:
    """Properties of an environment on which the lengths of observation terms depend."""

    arm_joints: int
    """Number of revolute joints (hinges) of the robot."""
    actions: int
    """Length of an action."""
    workers: int
    """Number of workers."""
    horizons: int = 0
    """Number of forecast horizons."""
    uncertainty: tuple[str, ...] = ()
    """Selected values of `UNCERTAINTY`."""
    hands: int = 0
    """1 for a robot with a hand (fingers or suction cups), otherwise 0."""
    fingers: int = 0
    """1 for a robot with a hand that has fingers, otherwise 0."""
    objects: int = 0
    """Number of loose objects of the task."""
    slides: int = 0
    """Number of prismatic joints (slides) of the robot."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class ObservationTerm:
    """One block of the flat observation, computed as clip(function, -bound, bound) / scale."""

    name: str
    """Name of the term in `split_observation` and on the environment's documentation page."""
    size: int | Callable[[Sizes], int]
    """Number of entries, or a function that computes it from `Sizes`."""
    unit: str
    """Unit of the function's result: "m", "rad", ..., or "-" if it has none."""
    frame: str
    """Coordinate frame of the function's result: "world", "base", ..., or "-" if it has none."""
    bound: float
    """Largest magnitude, in `unit`; larger values are clipped."""
    scale: float
    """Magnitude that corresponds to an observed value of 1, in `unit`."""
    doc: str
    """Description of the term for the environment's documentation page, in one sentence."""
    function: Callable[[Belief], Floats]
    """Callable that computes an array (B, ...) from a belief. The array is flattened for each
    environment. The callable is not used for a term without entries."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for a function that does not take one argument."""
        check_arguments(f"The observation term {self.name!r}", self.function, "belief")


def _nearest_direction(belief: Belief) -> Floats:
    """Return unit vectors (B, W, 3) from the robot to nearby bodies; 0 for distant bodies."""
    to_worker = belief.separation.point_b_world - belief.separation.point_a_world
    near = belief.separation.distance_m < FAR_SEPARATION_M
    return np.where(near[..., None], directions(to_worker, 1e-3), 0.0)


def directions(vectors: Floats, softening: float) -> Floats:
    """Return vectors (..., 3), each divided by its length plus `softening`; zero stays zero."""
    shortened = np.array(vectors)
    _shorten(shortened.reshape(-1, 3), softening)
    return shortened


@kernel
def _shorten(vectors: Floats, softening: float) -> None:
    """Divide each of the vectors (n, 3) in place by its length plus `softening`."""
    for k in range(len(vectors)):
        x, y, z = vectors[k, 0], vectors[k, 1], vectors[k, 2]
        divisor = math.sqrt(x * x + y * y + z * z) + softening
        for i in range(3):
            vectors[k, i] /= divisor


def _hinges(belief: Belief, values: Floats) -> Floats:
    """Select the values of revolute joints from those of all joints (B, N)."""
    return values if belief.robot.slides is None else values[:, ~belief.robot.slides]


def _slides(belief: Belief, values: Floats) -> Floats:
    """Select the values of prismatic joints from those of all joints (B, N)."""
    return values[:, require(belief.robot.slides, "A slide")]


def _hand(belief: Belief) -> HandState:
    """Return the state of the hand, or raise an error if the robot has none."""
    return require(belief.hand, "A hand")


def _objects(belief: Belief) -> ObjectState:
    """Return the state of the loose objects, or raise an error if there are none."""
    return require(belief.objects, "A loose object")


def _joints_forecast(belief: Belief) -> Floats:
    """Return joint forecasts (B, W, H, J, 3) for H horizons, relative to the tool point [m]."""
    joints = np.stack([later.mean_world for later in belief.forecast], axis=2)
    return joints - belief.robot.tool_world[:, None, None, None]


ROBOT_TERMS: tuple[ObservationTerm, ...] = (
    ObservationTerm(
        name="joint_angle_sin",
        size=lambda sizes: sizes.arm_joints,
        unit="-",
        frame="base",
        bound=1.0,
        scale=1.0,
        doc="Sine of each arm joint's angle.",
        function=lambda belief: np.sin(_hinges(belief, belief.robot.q)),
    ),
    ObservationTerm(
        name="joint_angle_cos",
        size=lambda sizes: sizes.arm_joints,
        unit="-",
        frame="base",
        bound=1.0,
        scale=1.0,
        doc="Cosine of each arm joint's angle.",
        function=lambda belief: np.cos(_hinges(belief, belief.robot.q)),
    ),
    ObservationTerm(
        name="joint_velocity",
        size=lambda sizes: sizes.arm_joints,
        unit="rad/s",
        frame="base",
        bound=4.0,
        scale=1.0,
        doc="Velocity of each arm joint.",
        function=lambda belief: _hinges(belief, belief.robot.qd),
    ),
    ObservationTerm(
        name="tool_position",
        size=lambda sizes: 3,
        unit="m",
        frame="world",
        bound=4.0,
        scale=1.0,
        doc="Position of the tool point.",
        function=lambda belief: belief.robot.tool_world,
    ),
    ObservationTerm(
        name="tool_axes",
        size=lambda sizes: 6 * sizes.hands,
        unit="-",
        frame="world",
        bound=1.0,
        scale=1.0,
        doc="The tool's x axis, along which fingers move, and its z axis, away from the arm.",
        function=lambda belief: belief.robot.tool_axes_world[..., [0, 2]].swapaxes(-1, -2),
    ),
    ObservationTerm(
        name="hand_opening",
        size=lambda sizes: sizes.fingers,
        unit="m",
        frame="tool",
        bound=0.2,
        scale=0.05,
        doc="Distance of each finger from the center of the gripper.",
        function=lambda belief: _hand(belief).opening_m,
    ),
    ObservationTerm(
        name="hand_force",
        size=lambda sizes: sizes.hands,
        unit="N",
        frame="tool",
        bound=300.0,
        scale=100.0,
        doc="Force that closes the fingers (negative if it opens them), or the load on the suction "
        "cups.",
        function=lambda belief: _hand(belief).force_n,
    ),
    ObservationTerm(
        name="object_from_tool",
        size=lambda sizes: 3 * sizes.objects,
        unit="m",
        frame="world",
        bound=3.0,
        scale=0.5,
        doc="Measured center of each loose object, relative to the tool point.",
        function=lambda belief: _objects(belief).position_world - belief.robot.tool_world[:, None],
    ),
    ObservationTerm(
        name="object_axes",
        size=lambda sizes: 6 * sizes.objects,
        unit="-",
        frame="world",
        bound=1.0,
        scale=1.0,
        doc="Measured y axis and z axis of each loose object.",
        function=lambda belief: matrix(_objects(belief).quaternion_wxyz)[..., 1:].swapaxes(-1, -2),
    ),
    ObservationTerm(
        name="object_held",
        size=lambda sizes: sizes.objects,
        unit="-",
        frame="-",
        bound=1.0,
        scale=1.0,
        doc="1 if the robot holds the object, else 0.",
        function=lambda belief: _objects(belief).held.astype(float),
    ),
)
"""Observation terms about the robot and the objects that it handles, which come first."""

SLIDE_TERMS: tuple[ObservationTerm, ...] = (
    ObservationTerm(
        name="slide_position",
        size=lambda sizes: sizes.slides,
        unit="m",
        frame="world",
        bound=10.0,
        scale=5.0,
        doc="Position of each prismatic joint; for a mobile base, x and y of its center.",
        function=lambda belief: _slides(belief, belief.robot.q),
    ),
    ObservationTerm(
        name="slide_velocity",
        size=lambda sizes: sizes.slides,
        unit="m/s",
        frame="world",
        bound=4.0,
        scale=1.0,
        doc="Velocity of each prismatic joint.",
        function=lambda belief: _slides(belief, belief.robot.qd),
    ),
)
"""Observation terms about the prismatic joints of a mobile base, which follow `ROBOT_TERMS`."""

SHARED_TERMS: tuple[ObservationTerm, ...] = (
    ObservationTerm(
        name="last_action",
        size=lambda sizes: sizes.actions,
        unit="-",
        frame="-",
        bound=1.0,
        scale=1.0,
        doc="Action of the agent in the previous step, before any shield changed it.",
        function=lambda belief: belief.action,
    ),
    ObservationTerm(
        name="worker_joints_from_tool",
        size=lambda sizes: sizes.workers * N_JOINTS * 3,
        unit="m",
        frame="world",
        bound=6.0,
        scale=1.0,
        doc="Estimated position of each joint of each worker, relative to the tool point.",
        function=lambda belief: belief.estimate.mean_world - belief.robot.tool_world[:, None, None],
    ),
    ObservationTerm(
        name="worker_joints_std",
        size=lambda sizes: sizes.workers * N_JOINTS,
        unit="m",
        frame="world",
        bound=1.0,
        scale=0.25,
        doc="Standard deviation of each estimated joint (root mean square over the axes).",
        function=lambda belief: standard_deviation_m(belief.estimate),
    ),
    ObservationTerm(
        name="worker_joints_age",
        size=lambda sizes: sizes.workers * N_JOINTS,
        unit="s",
        frame="-",
        bound=2.0,
        scale=1.0,
        doc="Time since a measurement last supported each joint.",
        function=lambda belief: belief.estimate.age_s,
    ),
    ObservationTerm(
        name="worker_joints_velocity",
        size=lambda sizes: sizes.workers * N_JOINTS * 3,
        unit="m/s",
        frame="world",
        bound=4.0,
        scale=2.0,
        doc="Estimated velocity of each joint.",
        function=lambda belief: belief.estimate.velocity_world,
    ),
    ObservationTerm(
        name="worker_tracked",
        size=lambda sizes: sizes.workers,
        unit="-",
        frame="-",
        bound=1.0,
        scale=1.0,
        doc="1 while the worker is tracked, 0 while the estimate is the prior or the track is "
        "lost.",
        function=lambda belief: belief.estimate.tracked.astype(float),
    ),
    ObservationTerm(
        name="worker_unknown",
        size=lambda sizes: sizes.workers,
        unit="-",
        frame="-",
        bound=1.0,
        scale=1.0,
        doc="1 while an untracked person may be near, because a track is lost or floor is "
        "unobserved.",
        function=lambda belief: belief.estimate.unknown.astype(float),
    ),
    ObservationTerm(
        name="worker_unobserved_time",
        size=lambda sizes: sizes.workers,
        unit="s",
        frame="-",
        bound=5.0,
        scale=2.5,
        doc="Time since cameras last observed the worker, or observed that the slot is empty.",
        function=lambda belief: belief.estimate.unobserved_s,
    ),
    ObservationTerm(
        name="worker_separation",
        size=lambda sizes: sizes.workers,
        unit="m",
        frame="-",
        bound=FAR_SEPARATION_M,
        scale=0.5,
        doc="Distance between the surfaces of the robot and the estimated body, at most 1 m.",
        function=lambda belief: np.minimum(belief.separation.distance_m, FAR_SEPARATION_M),
    ),
    ObservationTerm(
        name="worker_direction",
        size=lambda sizes: sizes.workers * 3,
        unit="-",
        frame="world",
        bound=1.0,
        scale=1.0,
        doc="Unit vector from the robot to the estimated body at their closest points; 0 beyond 1 "
        "m.",
        function=_nearest_direction,
    ),
    ObservationTerm(
        name="worker_joints_forecast",
        size=lambda sizes: sizes.workers * sizes.horizons * N_JOINTS * 3,
        unit="m",
        frame="world",
        bound=6.0,
        scale=1.0,
        doc="Forecast of each joint, relative to the current tool point, for each time of "
        "`forecast_s`.",
        function=_joints_forecast,
    ),
    ObservationTerm(
        name="worker_joints_forecast_std",
        size=lambda sizes: sizes.workers * sizes.horizons * N_JOINTS,
        unit="m",
        frame="world",
        bound=1.0,
        scale=0.25,
        doc="Standard deviation of each of these forecasts (root mean square over the axes).",
        function=lambda belief: np.stack(
            [standard_deviation_m(later) for later in belief.forecast], axis=2
        ),
    ),
    ObservationTerm(
        name="worker_joints_std_towards_robot",
        size=lambda sizes: sizes.workers * N_JOINTS * (TOWARDS_ROBOT in sizes.uncertainty),
        unit="m",
        frame="-",
        bound=1.0,
        scale=0.25,
        doc="Standard deviation of each joint in the direction of the closest point of the robot.",
        function=lambda belief: deviation_towards_robot_m(belief.robot, belief.estimate),
    ),
    ObservationTerm(
        name="worker_joints_factor",
        size=lambda sizes: sizes.workers * N_JOINTS * 6 * (FACTOR in sizes.uncertainty),
        unit="m",
        frame="world",
        bound=1.0,
        scale=0.25,
        doc="Cholesky factor L of each joint's covariance L L': xx, yx, yy, zx, zy, zz.",
        function=lambda belief: covariance_factor_m(belief.estimate),
    ),
)
"""Observation terms about the last action and the estimated workers, which follow those of the
task."""

SHIELD_TERMS: tuple[ObservationTerm, ...] = (
    ObservationTerm(
        name="shield_change",
        size=lambda sizes: sizes.arm_joints + sizes.slides,
        unit="rad/s",
        frame="base",
        bound=4.0,
        scale=1.0,
        doc="Joint velocities after the shield in the previous step, minus those that the agent "
        "requested.",
        function=lambda belief: require(
            belief.shield_change, "The change of the command by the shield"
        ),
    ),
)
"""Observation terms that are appended if `HRCConfig.observe_shield` is true."""


class TermDict(RenamedKeys):
    """Values by observation term, with errors that name the right key for a former one."""

    KIND = "observation term"
    RENAMED = RENAMED


@dataclass(frozen=True, slots=True)
class ObservationLayout:
    """Assignment of the entries of the flat observation to terms."""

    terms: tuple[int, ...]
    """Indices of the terms that have entries."""
    slices: dict[str, slice]
    """Slice of the entries of each term, by name of the term."""
    low: Tensor
    """(n,) lower bound of each entry."""
    high: Tensor
    """(n,) upper bound of each entry."""
    scale: Floats
    """(n,) magnitude that corresponds to an observed value of 1 for each entry, in the unit of its
    term."""


def make_layout(terms: tuple[ObservationTerm, ...], sizes: Sizes) -> ObservationLayout:
    """Compute the layout of the flat observation for given sizes."""
    counts = [term.size if isinstance(term.size, int) else term.size(sizes) for term in terms]
    ends = np.cumsum(counts).tolist()
    slices = TermDict(
        {t.name: slice(end - n, end) for t, n, end in zip(terms, counts, ends, strict=True)}
    )
    bound = np.repeat([term.bound / term.scale for term in terms], counts).astype(np.float32)
    scale = np.repeat([term.scale for term in terms], counts)
    present = tuple(np.flatnonzero(counts).tolist())
    return ObservationLayout(present, slices, -bound, bound, scale)


def observe(
    belief: Belief, layout: ObservationLayout, terms: tuple[ObservationTerm, ...]
) -> Tensor:
    """Compute the flat observations for beliefs.

    Args:
        belief: beliefs of B robots.
        layout: layout of the terms.
        terms: all terms.

    Returns:
        (B, n) flat observations.

    Raises:
        ConfigError: the number of entries of a term differs from its `size`.
        FloatingPointError: a term is NaN, which indicates an error in the code and never a fault of
            a camera.
    """
    batch = len(belief.action)
    present = [terms[k] for k in layout.terms]
    values = [_value(term, belief) for term in present]
    for term, value in zip(present, values, strict=True):
        if np.shape(value)[:1] != (batch,):
            name, rows = f"rows of observation term {term.name!r}", np.shape(value)[:1]
            check_shape(name, rows, (batch,), "one entry per environment")
    parts = [value.reshape(batch, -1) for value in values]
    physical = np.concatenate(parts, axis=1)
    if physical.shape[1] != len(layout.scale):
        for term, part in zip(present, parts, strict=True):
            size = layout.slices[term.name].stop - layout.slices[term.name].start
            check_shape(f"observation term {term.name!r}", part.shape[1:], (size,), "its `size`")
    observation = np.empty(physical.shape, np.float32)
    if not _scale(physical, layout.scale, layout.low, layout.high, observation):
        names = [name for name, part in layout.slices.items() if np.isnan(physical[:, part]).any()]
        raise FloatingPointError(
            f"Observation terms that are not finite numbers: {', '.join(names)}."
        )
    return observation


def _value(term: ObservationTerm, belief: Belief) -> Floats:
    """Compute the value (B, ...) of a term; functions of users receive a read-only belief."""
    if is_of_user(term.function):
        return call_user_function(
            f"Observation term {term.name!r}", term.function, lend_belief(belief)
        )
    return term.function(belief)


@kernel
def _scale(physical: Floats, scale: Floats, low: Tensor, high: Tensor, observation: Tensor) -> bool:
    """Scale and clip the entries of observations, and return whether none is NaN.

    Args:
        physical: (B, n) entries in the terms' units.
        scale: (n,) magnitude that corresponds to an observed value of 1.
        low: (n,) lower bounds.
        high: (n,) upper bounds.
        observation: (B, n) output, which is filled.
    """
    numbers = True
    for b in range(physical.shape[0]):
        for i in range(physical.shape[1]):
            value = np.float32(physical[b, i] / scale[i])
            numbers &= value == value
            observation[b, i] = min(max(value, low[i]), high[i])
    return numbers


def split(observation: Tensor | Mapping[str, Tensor], layout: ObservationLayout) -> TermDict:
    """Split a flat observation (..., n) into named terms in their units.

    Goals and images of an observation dictionary are added without scaling.
    """
    if isinstance(observation, Mapping):
        beside: dict[str, Any] = {
            name: part if name.startswith(IMAGE) else np.asarray(part, float)
            for name, part in observation.items()
            if name != FLAT
        }
        return TermDict({**split(observation[FLAT], layout), **beside})
    physical = observation * layout.scale
    return TermDict({name: physical[..., part] for name, part in layout.slices.items()})
