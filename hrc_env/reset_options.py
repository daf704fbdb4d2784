"""Options of `reset` and `set_options`: the parts of an episode that a user fixes."""

import dataclasses
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from hrc_env.core.errors import (
    ConfigError,
    check_integer,
    check_names,
    check_shape,
    make_unknown_name_error,
)
from hrc_env.core.mapping import convert_to_hint
from hrc_env.core.typing import Floats, JointAngles
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.geometry.chains import SerialChain
from hrc_env.geometry.reach import check_reach
from hrc_env.motion.config import PeopleConfig, make_hand_params
from hrc_env.motion.decision import ANY_ACTIVITY, BehaviourParams, Cast, group_jobs
from hrc_env.motion.scripted import make_reaches
from hrc_env.motion.state import ACTIVITY_NAMES
from hrc_env.perception.faults.fault import FaultConfig, check_cameras
from hrc_env.pipeline.levels import CAMERA_LEVELS, check_supported
from hrc_env.pipeline.observed_images import ObservedImages
from hrc_env.scene.build import Scene, with_rig
from hrc_env.scene.domain_randomization import AppearanceConfig
from hrc_env.scene.rig import select
from hrc_env.scene.rig_distribution import RigDistribution, draw_rig
from hrc_env.scene.rigs import describe_defects
from hrc_env.settings import rig_of
from hrc_env.tasks.hooks import check_targets
from hrc_env.tasks.task import AnyTask


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResetOptions:
    """Fixed parts of an episode; the field names are the keys of `reset(options={...})`.

    An instance of this class is also accepted in place of the mapping. All other parts are sampled
    from the same random streams as without options. A vector environment takes one value for all
    environments. For `goal`, `start_q`, `n_workers` and `steps_left`, it also takes an array with a
    row for each environment. Its additional key "each" takes a list with a mapping (or None) for
    each environment. `set_options` takes all fields except `steps_left`, for all future resets,
    including those after the end of an episode.
    """

    goal: ArrayLike | None = None
    """Goal of the task: a position (x, y, z) [m, world] in `HRCReachGoal-v0`, and for the first
    goal in `HRCReach-v0`. Other built-in tasks take no goal; a custom task may
    (`Task.set_goal`)."""
    n_workers: int | None = None
    """Number of workers; at most the number for which the environment was made."""
    bodies: str | Sequence[str] | None = None
    """Name of the body of all workers, or a list with a name for each, from `config.worker`."""
    people: "str | PeopleConfig | Mapping[str, Any] | None" = None
    """Behaviour of workers towards the robot, as for `EnvConfig.people`."""
    activity: "str | Sequence[str | None] | None" = None
    """First activity of all workers, such as "hammer", or a list with one for each worker (None for
    a random one); all further activities are sampled."""
    start_q: ArrayLike | None = None
    """(N,) initial joint positions of the robot: angles [rad], or displacements of slides [m]."""
    cameras: Any = None
    """Rig, as for `EnvConfig.cameras`. Its cameras must have names of the environment's cameras,
    some of which may be missing. If a `RigDistribution` is given, the rig is sampled from it."""
    faults: "Sequence[FaultConfig | Mapping[str, Any]] | None" = None
    """Faults of cameras, which replace the environment's `faults`."""
    appearance: "str | AppearanceConfig | Mapping[str, Any] | None" = None
    """Appearance of scene and workers, which replaces the environment's `appearance`."""
    steps_left: int | None = None
    """Number of steps after which the episode is truncated, unless the time limit ends it
    earlier."""


NAMES = tuple(each.name for each in dataclasses.fields(ResetOptions))
"""Names of the options."""
OF_SEVERAL = ("reset_mask", "each")
"""Options that only vector environments accept."""
ONE_RESET = ("steps_left",)
"""Options that apply to a single reset only, and that `set_options` therefore rejects."""
Options: TypeAlias = Mapping[str, Any]
"""Type of a mapping of options by name."""


def named_options(options: Options | ResetOptions | None, *more: str) -> dict[str, Any]:
    """Return options by name, without those that are None.

    Args:
        options: options as a record or a mapping.
        more: further valid names.

    Raises:
        ConfigError: a name is unknown; the error suggests the most similar option.
    """
    if isinstance(options, ResetOptions):
        options = {name: getattr(options, name) for name in NAMES}
    if not isinstance(options, Mapping | None):
        raise ConfigError(
            f"Options of a reset must be a mapping or hrc_env.ResetOptions, got {options!r}."
        )
    given, valid = dict(options or {}), tuple(dict.fromkeys((*NAMES, *more)))
    for name in given:
        if name in OF_SEVERAL and name not in valid:
            raise make_unknown_name_error("reset option of one environment", name, valid)
        if name not in valid:
            raise make_unknown_name_error("reset option", name, valid)
    return {name: value for name, value in given.items() if value is not None}


def lasting_options(options: Options | ResetOptions | None, *more: str) -> dict[str, Any]:
    """Return options for all future resets by name, without those that are None.

    Args:
        options: options as a record or a mapping.
        more: further valid names.

    Raises:
        ConfigError: a name is unknown, or is an option for a single reset only.
    """
    given = named_options(options, *more)
    for name in (*ONE_RESET, *more):
        if name in given and name != "each":
            raise ConfigError(
                f"{name} applies to a single reset: pass it to reset(options=...). "
                "set_options(...) applies to all later resets."
            )
    return given


@dataclass(frozen=True, slots=True, eq=False)
class Fixed:
    """Fixed parts of one environment's episode, after they have been checked.

    A part that is None is sampled, or is taken from the arguments of the environment.
    """

    goal: Floats | None = None
    """Goal of the task."""
    cast: Cast | None = None
    """Number, bodies, first activities and behaviour of the workers."""
    start_q: JointAngles | None = None
    """(N,) initial joint positions of the robot: angles [rad], or displacements of slides [m]."""
    rig: tuple[CameraConfig, ...] | None = None
    """Fixed rig, or the nominal rig of `rigs`."""
    rigs: RigDistribution | None = None
    """Distribution from which the rig is sampled; None for a fixed rig."""
    faults: tuple[FaultConfig, ...] | None = None
    """Faults of cameras."""
    appearance: AppearanceConfig | None = None
    """Appearance of scene and workers."""

    @property
    def changes_cameras(self) -> bool:
        """Whether options fix the rig, the faults or the appearance of the episode."""
        return any(each is not None for each in (self.rig, self.rigs, self.faults, self.appearance))


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """Settings of an environment against which options are checked."""

    task: AnyTask
    """Task of the environment."""
    scene: Scene
    """Scene with the environment's rig."""
    chain: SerialChain
    """Kinematics of the robot."""
    level: str
    """Perception level of the environment, as for `EnvConfig.perception`."""
    faults: tuple[FaultConfig, ...]
    """Faults of the environment's cameras."""
    appearance: AppearanceConfig
    """Appearance of the environment's scene and workers."""
    bodies: tuple[str, ...]
    """Names of the bodies that workers can have."""
    mind: BehaviourParams
    """Parameters of the workers' behaviour."""
    find_contact: Callable[[JointAngles], str | None]
    """Callable that returns the names of two geoms in contact at given joint angles, or None."""
    images: ObservedImages | None = None
    """Renderer of the images in observations; None without images."""
    wants_pairs: str = ""
    """Name of the estimator if it needs two cameras; otherwise ""."""


class ChosenRig(NamedTuple):
    """Parsed value of the option `cameras`."""

    rig: tuple[CameraConfig, ...] | None = None
    """The rig, or the nominal rig of the distribution; None without the option."""
    distribution: RigDistribution | None = None
    """Distribution from which the rig is sampled; None if the rig is fixed."""


def fix(options: Options, room: Room) -> Fixed:
    """Check the options of one environment's reset, and return the fixed parts of its episode.

    Args:
        options: options by name.
        room: settings of the environment.

    Raises:
        ConfigError: an option is invalid, or two options are incompatible.
    """
    given = named_options(options)
    rig, rigs = _rig(given.get("cameras"), room)
    faults, appearance = _faults(given, room), _appearance(given, room)
    if faults is not None or appearance is not None:
        check_supported(
            room.level,
            room.appearance if appearance is None else appearance,
            room.faults if faults is None else faults,
            shows_images=room.images is not None and room.level in CAMERA_LEVELS,
        )
    if room.images is not None and rig is not None:
        if room.level not in CAMERA_LEVELS:
            raise ConfigError(
                'options["cameras"] requires a perception level with cameras; with '
                f"perception={room.level!r}, images show the rig with which the environment was "
                "created."
            )
        room.images.check(rig if rigs is None else rigs.possible(rig))
    if faults is not None:
        names = [camera.name for camera in (room.scene.rig if rig is None else rig)]
        check_cameras(faults, names)
    has_cameras = room.level in CAMERA_LEVELS
    return Fixed(
        goal=_goal(given.get("goal"), room),
        cast=_cast(given, room),
        start_q=_start_q(given.get("start_q"), room),
        rig=rig if has_cameras else None,
        rigs=rigs if has_cameras else None,
        faults=faults,
        appearance=appearance,
    )


def _goal(goal: Any, room: Room) -> Floats | None:
    """Return the goal, or raise `ConfigError` if it is invalid or out of reach."""
    if goal is None:
        return None
    try:
        place = np.array(goal, float)
    except (TypeError, ValueError) as error:
        raise ConfigError(f'options["goal"] must be numbers, got {goal!r}.') from error
    if not np.isfinite(place).all():
        raise ConfigError(f'options["goal"] must be finite numbers, got {goal!r}.')
    targets = room.task.goal_targets(place)
    check_targets(f"{room.task.id}: goal_targets", targets)
    check_reach(room.task.id, room.scene.robot.name, room.chain, targets)
    return place


def _start_q(start_q: Any, room: Room) -> JointAngles | None:
    """Return the joint angles, or raise `ConfigError` if they are invalid or cause a contact."""
    if start_q is None:
        return None
    name, joints = 'options["start_q"]', room.scene.robot.joints
    try:
        q = np.array(start_q, float)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{name} must be numbers, got {start_q!r}.") from error
    check_shape(name, q.shape, (room.chain.n_joints,), f"one entry per joint: {', '.join(joints)}")
    for value, (low, high), joint in zip(q, room.chain.range_rad, joints, strict=True):
        if not low <= value <= high:
            raise ConfigError(
                f"{name}: joint {joint!r} must be from {low:.3f} to {high:.3f}, got {value:.3f}."
            )
    if touched := room.find_contact(q):
        raise ConfigError(f"{name}: with these angles, {touched} touch; choose other angles.")
    return q


def _cast(given: Options, room: Room) -> Cast | None:
    """Return the fixed number, bodies, activities and behaviour of workers; None if none is."""
    if not {"n_workers", "bodies", "people", "activity"} & set(given):
        return None
    most, n = room.scene.n_workers, None
    if "n_workers" in given:
        try:
            n = check_integer('options["n_workers"]', given["n_workers"], 0, most)
        except ConfigError as error:
            raise ConfigError(
                f"{error} The environment was created for {most}: create it with "
                "n_workers=(fewest, most) for more."
            ) from error
    count = most if n is None else n
    bodies = _one_each("bodies", given.get("bodies"), count)
    if bodies is not None:
        check_names("body (config.worker)", bodies, room.bodies)
    activities = _one_each("activity", given.get("activity"), count)
    if activities is not None:
        valid = sorted(group_jobs(room.mind.schedule))
        check_names(
            f"activity to begin with in {room.scene.name!r}:",
            [each for each in activities if each is not None],
            valid,
        )
    return Cast(
        n,
        None if bodies is None else tuple(map(room.bodies.index, bodies)),
        None if activities is None else tuple(map(_activity_index, activities)),
        _mind(given.get("people"), room.mind, most),
    )


def _activity_index(name: str | None) -> int:
    return ANY_ACTIVITY if name is None else ACTIVITY_NAMES.index(name)


def _one_each(name: str, value: Any, n_workers: int) -> list[Any] | None:
    """Return a list with one value for each worker, given a common value or such a list."""
    if value is None:
        return None
    if isinstance(value, str):
        return [value] * n_workers
    if not isinstance(value, Sequence | np.ndarray) or len(value) != n_workers:
        raise ConfigError(
            f'options["{name}"] must be a name, or a list of one for each of {n_workers} workers, '
            f"got {value!r}."
        )
    return list(value)


def _mind(people: Any, mind: BehaviourParams, n_workers: int) -> BehaviourParams | None:
    """Return the behaviour parameters for the option `people`; None without the option.

    Args:
        people: value of the option.
        mind: behaviour parameters of the environment.
        n_workers: maximum number of workers of the environment.
    """
    if people is None:
        return None
    config = replace(mind.config, people=convert_to_hint(PeopleConfig, people, "people"))
    return replace(
        mind,
        config=config,
        hand_params=make_hand_params(config, mind.hand_params.robot_xy_m),
        reaches=make_reaches(config, n_workers, mind.robot_girth_m > 0.0),
    )


def _rig(cameras: Any, room: Room) -> ChosenRig:
    """Return the rig of the option `cameras`, or raise `ConfigError` if it is invalid."""
    if cameras is None:
        return ChosenRig()
    if isinstance(cameras, np.ndarray):
        cameras = cameras.tolist()
    rigs = None
    if isinstance(cameras, RigDistribution | Mapping):
        rigs = convert_to_hint(RigDistribution, cameras, "cameras")
        rig = rigs.rig or room.scene.rig
        rigs.counts(len(rig))
        if room.level in CAMERA_LEVELS:  # to raise its errors early
            draw_rig(rigs, with_rig(room.scene, rig), np.random.default_rng(0))
    else:
        own = rig_of(cameras)
        rig = select(room.scene.rig, cameras) if own is None else select(own)
    names = [camera.name for camera in room.scene.rig]
    for camera in rig:
        if camera.name not in names:
            raise ConfigError(
                'options["cameras"]: the cameras of an episode must have names of those with which '
                f"the environment was created, {', '.join(names)}, which are part of info keys; "
                f"got {camera.name!r}. Create the environment with cameras= that contains all of "
                "them."
            )
    if rigs is None and room.level in CAMERA_LEVELS:
        for defect in describe_defects(with_rig(room.scene, rig), room.wants_pairs):
            warnings.warn(defect, stacklevel=5)
    return ChosenRig(rig, rigs)


def _faults(given: Options, room: Room) -> tuple[FaultConfig, ...] | None:
    """Return the faults in options; None without the option."""
    if "faults" not in given:
        return None
    faults: tuple[FaultConfig, ...] = convert_to_hint(
        tuple[FaultConfig, ...], given["faults"], "faults"
    )
    return faults


def _appearance(given: Options, room: Room) -> AppearanceConfig | None:
    """Return the appearance that the options specify, or None if they specify none."""
    if "appearance" not in given:
        return None
    appearance: AppearanceConfig = convert_to_hint(
        AppearanceConfig, given["appearance"], "appearance"
    )
    return appearance


def faults_of(
    faults: Sequence[FaultConfig], names: Sequence[str], rig: Sequence[CameraConfig]
) -> tuple[FaultConfig, ...]:
    """Return the faults that affect cameras in an episode's rig.

    Args:
        faults: faults of the environment's cameras.
        names: names of these cameras.
        rig: rig of the episode, with a subset of these cameras.
    """
    in_rig, kept = {camera.name for camera in rig}, list[FaultConfig]()
    for fault in faults:
        chosen = [each if isinstance(each, str) else names[each] for each in fault.cameras]
        cameras = tuple(each for each in chosen if each in in_rig or each not in names)
        if cameras:
            kept.append(replace(fault, cameras=cameras))
    return tuple(kept)
