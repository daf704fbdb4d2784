"""Options of `reset` and `set_options`: parts of an episode that a user fixes, checked in words."""

import dataclasses
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hrc_env.core.errors import ConfigError, check_names, check_shape, unknown, whole
from hrc_env.core.mapping import restored
from hrc_env.core.typing import Floats, JointAngles
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.geometry.chains import SerialChain
from hrc_env.geometry.reach import check_reach
from hrc_env.motion.config import PeopleConfig, numbers
from hrc_env.motion.decision import ANY_ACTIVITY, BehaviourParams, Cast, jobs_by_activity
from hrc_env.motion.state import ACTIVITY_NAMES
from hrc_env.perception.faults.fault import FaultConfig, check_cameras
from hrc_env.pipeline.levels import CAMERA_LEVELS, check_supported
from hrc_env.pipeline.observed_images import ObservedImages
from hrc_env.scene.build import Scene, with_rig
from hrc_env.scene.domain_randomization import AppearanceConfig
from hrc_env.scene.rig import select
from hrc_env.scene.rig_distribution import RigDistribution, draw_rig
from hrc_env.scene.rigs import findings
from hrc_env.settings import rig_of
from hrc_env.tasks.hooks import check_places
from hrc_env.tasks.task import Task


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResetOptions:
    """Parts of an episode that are fixed: the names that `reset(options={...})` takes.

    The record itself may be given, too. Other parts are drawn as they are without options, from
    the same random streams. A vector environment takes one value for all environments; of `goal`,
    `start_q`, `n_workers` and `steps_left` also an array with a row for each; and of any of them
    "each", a list of a mapping (or None) for each. `set_options` takes the same but `steps_left`:
    for all resets to come, also those after the end of an episode.
    """

    goal: ArrayLike | None = None
    """The task's goal: in `HRCReach-v0`, whose first it is, and `HRCReachGoal-v0` a place (x, y, z)
    [m, world]. Other tasks take none; one of yours may (`Task.set_goal`)."""
    n_workers: int | None = None
    """How many workers there are, up to as many as the environment was made for."""
    bodies: str | Sequence[str] | None = None
    """Whose body each worker has: a name for all, or one for each; among `config.worker`."""
    people: "str | PeopleConfig | Mapping[str, Any] | None" = None
    """How workers are with the robot, as the environment's `people`."""
    activity: "str | Sequence[str | None] | None" = None
    """The first activity of workers, "hammer" for example: one for all, or one for
    each (None: drawn). They go on as usual."""
    start_q: ArrayLike | None = None
    """(N,) the joint angles with which the robot starts [rad, m of slides]."""
    cameras: Any = None
    """The rig, as the environment's `cameras`; its cameras are called as those of the environment,
    and may be fewer. A `RigDistribution`: drawn."""
    faults: "Sequence[FaultConfig | Mapping[str, Any]] | None" = None
    """Faults of cameras, in place of the environment's `faults`."""
    appearance: "str | AppearanceConfig | Mapping[str, Any] | None" = None
    """How scene and workers look, in place of the environment's `appearance`."""
    steps_left: int | None = None
    """After so many steps this episode is truncated, if its time limit does not end it before."""


NAMES = tuple(each.name for each in dataclasses.fields(ResetOptions))
OF_SEVERAL = ("reset_mask", "each")
"""Options that only vector environments have."""
ONE_RESET = ("steps_left",)
"""Options that are of one reset only."""
Options = Mapping[str, Any]


def named_options(options: Options | ResetOptions | None, *more: str) -> dict[str, Any]:
    """Return options by name, without those that are None.

    Raises:
        ConfigError: a name that is no option, with the nearest; `more` are names that are valid
            here besides.
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
            raise unknown("reset option of one environment", name, valid)
        if name not in valid:
            raise unknown("reset option", name, valid)
    return {name: value for name, value in given.items() if value is not None}


def lasting_options(options: Options | ResetOptions | None, *more: str) -> dict[str, Any]:
    """Return options that are to hold for all resets to come; `ConfigError` as of `named_options`,
    and for what is of one reset."""
    given = named_options(options, *more)
    for name in (*ONE_RESET, *more):
        if name in given and name != "each":
            raise ConfigError(
                f"{name} is of one reset: give it to reset(options=...). set_options(...) is for "
                "all resets to come."
            )
    return given


@dataclass(frozen=True, slots=True, eq=False)
class Fixed:
    """Parts of one environment's episode that are not drawn, checked; None: drawn, or as it was
    made."""

    goal: Floats | None = None
    cast: Cast | None = None
    start_q: JointAngles | None = None
    rig: tuple[CameraConfig, ...] | None = None
    rigs: RigDistribution | None = None
    """From which the rig is drawn, and that in its middle is `rig`."""
    faults: tuple[FaultConfig, ...] | None = None
    appearance: AppearanceConfig | None = None

    @property
    def changes_cameras(self) -> bool:
        """Whether the cameras are others than those with which the environment was made."""
        return any(each is not None for each in (self.rig, self.rigs, self.faults, self.appearance))


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """Settings of an environment against which options are checked."""

    task: Task[Any, Any]
    scene: Scene
    chain: SerialChain
    level: str
    faults: tuple[FaultConfig, ...]
    appearance: AppearanceConfig
    bodies: tuple[str, ...]
    mind: BehaviourParams
    """The workers' parameters of decision."""
    touched_at: Callable[[JointAngles], str | None]
    """Returns the name of an obstacle at joint angles; None: none is touched."""
    images: ObservedImages | None = None
    """Draws the images of observations; None: they hold none."""
    wants_pairs: str = ""
    """The name of an estimator that needs two cameras; "": it does not."""


def fix(options: Options, room: Room) -> Fixed:
    """Return the fixed parts of one environment's episode.

    Raises:
        ConfigError: an option that cannot be, or two that exclude each other; before anything of
            the episode is drawn.
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
                'options["cameras"] are of a perception level with cameras; at perception='
                f"{room.level!r} images show the rig with which the environment was made."
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
    if goal is None:
        return None
    try:
        place = np.array(goal, float)
    except (TypeError, ValueError) as error:
        raise ConfigError(f'options["goal"] must be numbers, got {goal!r}.') from error
    if not np.isfinite(place).all():
        raise ConfigError(f'options["goal"] must be finite numbers, got {goal!r}.')
    targets = room.task.goal_targets(place)
    check_places(f"{room.task.id}: goal_targets", targets)
    check_reach(room.task.id, room.scene.robot.name, room.chain, targets)
    return place


def _start_q(start_q: Any, room: Room) -> JointAngles | None:
    if start_q is None:
        return None
    name, joints = 'options["start_q"]', room.scene.robot.joints
    try:
        q = np.array(start_q, float)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{name} must be numbers, got {start_q!r}.") from error
    check_shape(name, q.shape, (room.chain.n_joints,), f"one a joint: {', '.join(joints)}")
    for value, (low, high), joint in zip(q, room.chain.range_rad, joints, strict=True):
        if not low <= value <= high:
            raise ConfigError(
                f"{name}: joint {joint!r} must be from {low:.3f} to {high:.3f}, got {value:.3f}."
            )
    if touched := room.touched_at(q):
        raise ConfigError(f"{name}: with these angles {touched} touch; choose others.")
    return q


def _cast(given: Options, room: Room) -> Cast | None:
    """Return the people who are there, their first activities, and their behaviour."""
    if not {"n_workers", "bodies", "people", "activity"} & set(given):
        return None
    most, n = room.scene.n_workers, None
    if "n_workers" in given:
        try:
            n = whole('options["n_workers"]', given["n_workers"], 0, most)
        except ConfigError as error:
            raise ConfigError(
                f"{error} The environment was made for {most}: make it with "
                "n_workers=(fewest, most) for more."
            ) from error
    count = most if n is None else n
    bodies = _of_each("bodies", given.get("bodies"), count)
    if bodies is not None:
        check_names("body (config.worker)", bodies, room.bodies)
    activities = _of_each("activity", given.get("activity"), count)
    if activities is not None:
        valid = sorted(jobs_by_activity(room.mind.schedule))
        check_names(
            f"activity to begin with in {room.scene.name!r}:",
            [each for each in activities if each is not None],
            valid,
        )
    return Cast(
        n,
        None if bodies is None else tuple(map(room.bodies.index, bodies)),
        None if activities is None else tuple(map(_activity_index, activities)),
        _mind(given.get("people"), room.mind),
    )


def _activity_index(name: str | None) -> int:
    return ANY_ACTIVITY if name is None else ACTIVITY_NAMES.index(name)


def _of_each(name: str, value: Any, n_workers: int) -> list[Any] | None:
    """One value for each worker, from one for all or a list."""
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


def _mind(people: Any, mind: BehaviourParams) -> BehaviourParams | None:
    if people is None:
        return None
    config = replace(mind.config, people=restored(PeopleConfig, people, "people"))
    return replace(mind, config=config, numbers=numbers(config, mind.plan.grounds.robot_xy_m))


def _rig(
    cameras: Any, room: Room
) -> tuple[tuple[CameraConfig, ...] | None, RigDistribution | None]:
    """The rig, and the distribution of which it is the middle."""
    if cameras is None:
        return None, None
    if isinstance(cameras, np.ndarray):
        cameras = cameras.tolist()
    rigs = None
    if isinstance(cameras, RigDistribution | Mapping):
        rigs = restored(RigDistribution, cameras, "cameras")
        rig = rigs.rig or room.scene.rig
        rigs.counts(len(rig))
        if room.level in CAMERA_LEVELS:  # refused before anything is drawn
            draw_rig(rigs, with_rig(room.scene, rig), np.random.default_rng(0))
    else:
        own = rig_of(cameras)
        rig = select(room.scene.rig, cameras) if own is None else select(own)
    names = [camera.name for camera in room.scene.rig]
    for camera in rig:
        if camera.name not in names:
            raise ConfigError(
                f'options["cameras"]: the cameras of an episode must be called as those that the '
                f"environment was made with, {', '.join(names)}, which infos name; got "
                f"{camera.name!r}. Make the environment with cameras= of all of them."
            )
    if rigs is None and room.level in CAMERA_LEVELS:
        for finding in findings(with_rig(room.scene, rig), room.wants_pairs):
            warnings.warn(finding, stacklevel=5)
    return rig, rigs


def _faults(given: Options, room: Room) -> tuple[FaultConfig, ...] | None:
    if "faults" not in given:
        return None
    faults: tuple[FaultConfig, ...] = restored(tuple[FaultConfig, ...], given["faults"], "faults")
    return faults


def _appearance(given: Options, room: Room) -> AppearanceConfig | None:
    if "appearance" not in given:
        return None
    appearance: AppearanceConfig = restored(AppearanceConfig, given["appearance"], "appearance")
    return appearance


def faults_of(
    faults: Sequence[FaultConfig], names: Sequence[str], rig: Sequence[CameraConfig]
) -> tuple[FaultConfig, ...]:
    """Return the faults of those cameras that are in a rig, of a longer one with these `names`."""
    there, kept = {camera.name for camera in rig}, []
    for fault in faults:
        called = [each if isinstance(each, str) else names[each] for each in fault.cameras]
        cameras = tuple(each for each in called if each in there or each not in names)
        if cameras:
            kept.append(replace(fault, cameras=cameras))
    return tuple(kept)
