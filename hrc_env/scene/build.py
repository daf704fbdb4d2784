"""From settings to a compiled scene: room, arm, workers, cameras."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import mujoco
import numpy as np

from hrc_env.errors import ConfigError, unknown
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.geometry.chains import SerialChain
from hrc_env.geometry.rotations import about_axis
from hrc_env.scene.arena import add_lab
from hrc_env.scene.arm import HOME_Q, add_arm, arm_chain
from hrc_env.scene.rig import LAB_CAMERAS, CameraConfig, add_cameras, pinholes, select
from hrc_env.typing import Ints, JointAngles

ROBOT_BASE_WORLD = (-0.75, 0.0, 0.75)
"""The middle of the arm's foot, on the pedestal [m]."""
ROBOT_YAW_RAD = math.pi
"""The arm reaches along its own -x, which so looks to world +x."""


@dataclass(frozen=True, slots=True)
class SceneConfig:
    """What stands in the room and how finely time is cut."""

    clutter: bool = True
    """Whether furniture and building material stand in the room."""
    sim_dt: float = 0.004
    """Seconds a physics substep takes [s]."""
    slew_rad_s2: float = 8.0
    """Fastest change of a commanded joint velocity [rad/s^2]; keeps the overshoot below 5 %."""
    leash_rad: float = 0.05
    """How far the holding servo's angle may be ahead of a blocked joint [rad]."""
    cameras: tuple[CameraConfig, ...] = LAB_CAMERAS
    """All cameras that hang in the room; `build` says which are switched on."""

    def __post_init__(self) -> None:
        for name in ("sim_dt", "slew_rad_s2", "leash_rad"):
            if not getattr(self, name) > 0:
                raise ConfigError(f"{name} must be positive, got {getattr(self, name)}.")


SCENES: dict[str, Callable[[Any, bool], None]] = {"lab": add_lab}
"""What builds each scene's room: a function of the MjSpec and of whether it is cluttered."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A compiled scene: one model that every environment of a batch shares."""

    config: SceneConfig
    name: str
    n_workers: int
    body_name: str
    model: mujoco.MjModel
    chain: SerialChain
    cameras: tuple[PinholeCamera, ...]
    home_q: JointAngles
    """(N,) the arm's pose at rest [rad]."""
    worker_mocap: Ints
    """(W, S) mocap row of every body segment of every worker."""


def build(
    config: SceneConfig | None = None,
    name: str = "lab",
    n_workers: int = 0,
    body_name: str = "worker_1",
    cameras: Sequence[int | str] | None = None,
) -> Scene:
    """The scene of these settings, compiled once and kept.

    Args:
        config: settings; None takes the defaults.
        name: which scene, a key of `SCENES`.
        n_workers: how many workers it has room for, 0 or more.
        body_name: the baked body of all of them.
        cameras: names or indices of the cameras that are used; None uses all.

    Raises:
        ConfigError: an unknown scene or camera, or a negative number of workers.
    """
    if name not in SCENES:
        raise unknown("scene", name, SCENES)
    if n_workers < 0:
        raise ConfigError(f"n_workers must be 0 or more, got {n_workers}.")
    use = None if cameras is None else tuple(cameras)
    return _build(config or SceneConfig(), name, n_workers, body_name, use)


@lru_cache(maxsize=8)
def _build(
    config: SceneConfig, name: str, n_workers: int, body_name: str, use: tuple | None
) -> Scene:
    cameras = pinholes(select(config.cameras, use))
    spec = make_spec(config, name, cameras)
    segments = [_add_worker(spec, worker, body_name) for worker in range(n_workers)]
    model = spec.compile()
    return Scene(
        config=config,
        name=name,
        n_workers=n_workers,
        body_name=body_name,
        model=model,
        chain=arm_chain(_base_transform()),
        cameras=cameras,
        home_q=HOME_Q.copy(),
        worker_mocap=_mocap_rows(model, segments),
    )


def make_spec(config: SceneConfig, name: str, cameras: tuple[PinholeCamera, ...]) -> mujoco.MjSpec:
    """The room with the arm and the cameras, before any worker walks in."""
    spec = mujoco.MjSpec()
    spec.modelname = name
    spec.compiler.degree = 0
    spec.option.timestep = config.sim_dt
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.memory = 2**22
    SCENES[name](spec, config.clutter)
    add_arm(spec, ROBOT_BASE_WORLD, ROBOT_YAW_RAD)
    add_cameras(spec, cameras)
    return spec


def _base_transform() -> np.ndarray:
    transform = np.eye(4)
    transform[:3, :3] = about_axis("z", ROBOT_YAW_RAD)
    transform[:3, 3] = ROBOT_BASE_WORLD
    return transform


def _add_worker(spec: mujoco.MjSpec, worker: int, body_name: str) -> list[str]:
    """One worker; the names of their segments' bodies in the model."""
    from hrc_env.body import SEGMENTS, load_body, load_looks
    from hrc_env.scene.worker import add_worker

    prefix = f"worker_{worker + 1}/"
    add_worker(spec, load_body(body_name), load_looks(body_name), prefix)
    return [prefix + name for name in SEGMENTS]


def _mocap_rows(model: mujoco.MjModel, segments: list[list[str]]) -> Ints:
    rows = [[model.body_mocapid[model.body(name).id] for name in names] for names in segments]
    return np.array(rows, np.int64) if rows else np.zeros((0, 0), np.int64)
