"""Today's names for what the probes use: the only file here that a rename may touch.

Everything that the probes know of `hrc_env` and `agents` they reach through these functions. A
commit that changes this file must not change recorded values, and the other way round
(`python -m tests.behaviour --commits` refuses it).
"""

import contextlib
import dataclasses
import functools
import io
import json
import os
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import gymnasium
import mujoco
import numpy as np
from numpy.typing import NDArray
from rich.console import Console

import hrc_env
from assets.recordings.written import ORDERS, Y_UP, cmu_name, write_acclaim, write_bvh
from hrc_env import observations
from hrc_env.agents import policies as trained
from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import find_control, make_agent
from hrc_env.belief import (
    Belief,
    covariance_factor_m,
    deviation_towards_robot_m,
    estimated_separation,
    find_unseen_floor,
    standard_deviation_m,
)
from hrc_env.core import infos
from hrc_env.core.errors import ConfigError
from hrc_env.core.infos import ENTRIES
from hrc_env.core.records import (
    HandState,
    Held,
    Keypoints,
    ObjectState,
    PoseEstimate,
    Roi,
    WorkerMotion,
    WorkerPath,
    WorkerTruth,
)
from hrc_env.core.skeleton import JOINTS
from hrc_env.core.vacancy import Coverage, Others, Vacancy, no_others
from hrc_env.geometry import cameras, chains, distances, enclosure, shapes, sight, ways
from hrc_env.geometry import lines_of_sight as lines
from hrc_env.geometry import rotations as turns
from hrc_env.geometry.assignment import assign_rows
from hrc_env.geometry.camera_config import MAKES, CameraConfig
from hrc_env.geometry.inertia import LinkInertias
from hrc_env.geometry.lens import Lens, lens_row
from hrc_env.geometry.reach import ReachTarget, check_reach
from hrc_env.geometry.robot_model import RobotModel
from hrc_env.geometry.rotations import matrix
from hrc_env.geometry.triangulation import linear_point, triangulate
from hrc_env.mocap import footing, person, repair, stance
from hrc_env.mocap.guess import guess_controls
from hrc_env.mocap.poses import locate_joints, make_marks, pose_segments
from hrc_env.mocap.read import read_recording as read_capture
from hrc_env.mocap.record import Capture
from hrc_env.mocap.retarget import fit_controls, retarget, scale_joints
from hrc_env.motion import config as motion_config
from hrc_env.motion import floorplan, lying, paths, repertoire, routes, schedule, starting, starts
from hrc_env.motion import generator as motion
from hrc_env.motion.activities.pieces import cut_clips as cut_into_pieces
from hrc_env.motion.activities.pieces import make_stage
from hrc_env.motion.anatomy import measure_body as measure_anatomy
from hrc_env.motion.clip import Clip, load_clip, move_to_origin, save_clip, scale_clip
from hrc_env.motion.points import Point
from hrc_env.motion.traffic import find_meeting
from hrc_env.perception import (
    blazepose,
    calibration,
    detector,
    lenses,
    noise,
    outline,
    plausibility,
    searching,
    windows,
)
from hrc_env.perception import emulator as keypoint_emulator
from hrc_env.perception.faults import camera_film, corruptions
from hrc_env.perception.faults import fault as faults
from hrc_env.perception.faults import schedule as fault_schedule
from hrc_env.pipeline import reacquisition
from hrc_env.pipeline.bystanders import Bystanders
from hrc_env.pipeline.pose_tracker import PoseTracker
from hrc_env.safety import contact, incidents, separation, solver
from hrc_env.safety.built_in import build_constraints, describe_pose
from hrc_env.safety.config import PRESETS, ShieldConfig
from hrc_env.safety.shield import apply_shield, find_shield
from hrc_env.safety.unseen import find_undetected
from hrc_env.scene import domain_randomization as looks
from hrc_env.scene import rigs
from hrc_env.scene.build import SceneConfig, drawing_model, find_visuals
from hrc_env.scene.build import build as build_scene
from hrc_env.scene.objects import find_held
from hrc_env.scene.render import CropRenderer
from hrc_env.scene.rig import make_cameras
from hrc_env.scene.rigs import sample_floor as floor_points
from hrc_env.scene.robot import ROBOTS, make_chain
from hrc_env.settings import resolve_settings
from hrc_env.simulation import Simulation
from hrc_env.tasks.reach import MIDDLE
from hrc_env.tasks.task import find_task
from hrc_env.tracking import metrics, oracle, presence
from hrc_env.tracking.calibration_monitor import forget_monitor, make_monitor, monitor
from hrc_env.tracking.config import PaperConfig, ParticleConfig, TrackerConfig
from hrc_env.tracking.contradiction import DetectedPoses, find_unexplained
from hrc_env.tracking.estimators import ESTIMATORS, find_estimator, make_estimator
from hrc_env.tracking.forecast import forecast
from hrc_env.tracking.frozen_frames import (
    find_live_cameras,
    forget_frozen,
    leave_out_frozen,
    make_frozen,
)
from hrc_env.tracking.people.association import associate
from hrc_env.tracking.smoother import smooth
from hrc_env.vector.env import HRCVectorEnv
from hrc_env.worker import body as bodies
from hrc_env.worker import props
from hrc_env.world import WorkerSignal, Workplace, World

# --- Versions (accept.py) ------------------------------------------------------------------------


def subsystems() -> tuple[str, ...]:
    """Return the names in `behaviour.toml`."""
    from hrc_env.experiments.versions import SUBSYSTEMS  # here: older code has none

    return SUBSYSTEMS


def read_versions(path: Path) -> dict[str, int]:
    """Return the version of each subsystem that a file gives."""
    from hrc_env.experiments import versions

    return versions.read_versions(path)


# --- Environments and agents (env.py, agents.py) -------------------------------------------------

ENV_IDS = tuple(hrc_env.IDS)
"""Every id that the package registers."""
ARGUMENTS = {
    name: name
    for name in (
        "perception", "estimator", "scene", "robot", "n_workers", "people", "control", "shield",
        "appearance", "motions", "render_mode",
    )
}  # fmt: skip
"""Names of the probes for arguments of an environment, and today's."""
SETTINGS = {
    "ends_on_contact": "cost.contact_terminates",
    "cost_components": "cost.components",
    "cost_below_m": "cost.proximity_m",
    "bodies": "worker",
    "forecast_s": "forecast_s",
    "covariance_terms": "uncertainty",
    "observes_shield": "observe_shield",
    "jobs": "motion.jobs",
    "reward_kind": "task.reward",
    "motions_probability": "motion.motions_probability",
    "object_noise_m": "objects.noise_m",
    "joint_speed_share": "control.joint_speed_share",
    "step_s": "ctrl_dt",
}
"""Names of the probes for settings, and the paths of today's fields."""
COMPONENTS = {"too_near": "separation_violated"}
"""Names of the probes for components of the cost, and today's where they differ."""
FAULT_FIELDS = {
    "kind": "kind", "cameras": "cameras", "amount": "amount", "from_s": "start_s",
    "until_s": "end_s",
}  # fmt: skip
CAMERA_FIELDS = {
    "name": "name", "eye_m": "eye_world", "target_m": "target_world", "latency_s": "latency_s",
    "rate_hz": "rate_hz", "width_px": "width_px", "height_px": "height_px",
    "field_deg": "hfov_deg", "roll_deg": "roll_deg",
}  # fmt: skip
MODEL_ARRAYS = (
    "geom_type", "geom_pos", "geom_quat", "geom_size", "geom_contype", "geom_conaffinity",
    "geom_condim", "geom_friction", "geom_solref", "geom_solimp", "geom_margin", "geom_rgba",
    "body_pos", "body_quat", "body_mass", "body_inertia", "body_mocapid", "jnt_type", "jnt_pos",
    "jnt_axis", "jnt_range", "dof_damping", "dof_armature", "dof_frictionloss", "qpos0",
    "actuator_gainprm", "actuator_biasprm", "actuator_ctrlrange", "actuator_forcerange",
    "site_pos", "cam_pos", "cam_quat", "cam_fovy", "light_pos", "light_dir", "eq_data",
)  # fmt: skip
"""Arrays of MuJoCo's compiled model, by MuJoCo's names."""
CONTACT_ARRAYS = (
    "pair_geom1", "pair_geom2", "pair_dim", "pair_friction", "pair_solref", "pair_solimp",
    "pair_margin", "exclude_signature", "geom_group", "geom_rbound", "geom_dataid", "geom_matid",
    "body_gravcomp", "body_parentid", "body_ipos", "body_iquat", "jnt_margin", "jnt_limited",
    "dof_invweight0", "actuator_trnid", "actuator_gear", "eq_active0", "eq_solref", "eq_solimp",
    "cam_intrinsic", "cam_sensorsize", "cam_resolution", "light_diffuse", "light_ambient",
    "light_specular", "light_castshadow", "mat_rgba", "mat_specular", "mat_shininess", "site_size",
    "site_quat", "mesh_pos", "mesh_vertnum",
)  # fmt: skip
"""Others of them: which bodies may touch, and how they look and move."""
OPTIONS = (
    "timestep", "gravity", "integrator", "cone", "solver", "iterations", "tolerance", "impratio",
    "disableflags", "enableflags",
)  # fmt: skip
DRAWING = (
    ("quality", ("offsamples", "shadowsize", "numslices", "numstacks", "numquads")),
    ("headlight", ("ambient", "diffuse", "specular", "active")),
    ("map", ("znear", "zfar", "fogstart", "fogend", "haze", "shadowclip", "shadowscale", "alpha")),
)
"""How MuJoCo draws, by its names."""
TERMS: dict[str, str] = {present: former for former, present in observations.RENAMED.items()}
"""Today's names of observation terms that the probes know by another."""
RENAMED: dict[str, str] = {
    **{present: former for former, present in reversed(infos.RENAMED.items())},
    **{f"observation/{present}": f"observation/{former}" for present, former in TERMS.items()},
}
"""Today's names of observation terms, reward terms and infos that the probes know by another."""


def _arguments(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return today's arguments of an environment for the probes' options, as `Env` takes them."""
    arguments: dict[str, Any] = {}
    config: dict[str, Any] = {}
    for name, value in options.items():
        if name in ARGUMENTS:
            arguments[ARGUMENTS[name]] = value
        elif name == "faults":
            arguments["faults"] = [_renamed(each, FAULT_FIELDS) for each in value]
        elif name == "cameras":
            arguments["cameras"] = [_renamed(each, CAMERA_FIELDS) for each in value]
        elif name in ("kept_cameras", "rig"):
            arguments["cameras"] = value
        elif name == "cost_components":
            _put(config, SETTINGS[name], [COMPONENTS.get(each, each) for each in value])
        else:
            _put(config, SETTINGS[name], value)
    return {**arguments, "config": config}


class Env:
    """One environment, with everything that it gives by the probes' names."""

    def __init__(self, env_id: str, **options: Any) -> None:
        """Make an environment.

        Args:
            env_id: a registered id.
            options: names of `ARGUMENTS` and `SETTINGS`; `faults` and `cameras`, mappings with the
                names of `FAULT_FIELDS` and `CAMERA_FIELDS`; `kept_cameras`, indices of the scene's;
                `rig`, the name of a rig.
        """
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # a rig of one camera, as it is meant
            self._env = gymnasium.make(env_id, disable_env_checker=True, **_arguments(options))
        base: Any = self._env.unwrapped
        self._slices = base.simulation.layout.slices
        self._simulation = base.simulation
        self.action_size = int(np.prod(self._env.action_space.shape or ()))

    def reset(self, seed: int | None) -> dict[str, Any]:
        """Start an episode and return everything that is known of it then."""
        self.observation, info = self._env.reset(seed=seed)
        return self._name_values({}, _of_reset(self._as_named(info)))

    def step(self, action: NDArray[np.float32]) -> tuple[dict[str, Any], bool]:
        """Act for one step and return everything that is known then, and whether it is over."""
        self.observation, reward, terminated, truncated, info = self._env.step(action)
        values = {"reward": reward, "terminated": terminated, "truncated": truncated}
        return self._name_values(values, self._as_named(info)), bool(terminated or truncated)

    def save(self) -> Any:
        """Return a copy of everything that changes in an episode."""
        return self._env.unwrapped.get_state()  # type: ignore[attr-defined]

    def restore(self, state: Any) -> None:
        """Go back to a saved state."""
        self._env.unwrapped.set_state(state)  # type: ignore[attr-defined]

    def bounds(self) -> dict[str, NDArray[np.float64]]:
        """Return the bounds of the observation and of the action, and each term's scale."""
        layout = self._simulation.layout
        low, high = layout.low, layout.high
        terms = {
            TERMS.get(name, name): np.concatenate([low[part], high[part], layout.scale[part]])
            for name, part in self._slices.items()
        }
        terms["action"] = np.concatenate([np.ravel(self._env.action_space.low),
                                          np.ravel(self._env.action_space.high)])  # fmt: skip
        spaces = self._env.observation_space
        for name in ("achieved_goal", "desired_goal") if isinstance(spaces, Mapping) else ():
            terms[name] = np.concatenate([spaces[name].low, spaces[name].high])
        limit_s = self._env.spec.max_episode_steps * self._simulation.config.ctrl_dt
        return {**terms, "time_limit_s": np.array([float(limit_s)])}

    def make_agent(self, name: str) -> Callable[[Any], NDArray[np.float32]]:
        """Return the policy of an agent by its name: from observations to actions."""
        return make_agent(name, env_info(self._simulation), seed=0).act

    def judge_goals(
        self, achieved: NDArray[np.float64], desired: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the reward of pairs of goals, as hindsight replay asks for it."""
        base: Any = self._env.unwrapped
        return np.asarray(base.compute_reward(achieved, desired, [{}] * len(achieved)))

    def describe_scene(self) -> dict[str, NDArray[np.float64]]:
        """Return the arrays of the compiled model, and all other numbers of the scene, sorted."""
        scene = self._simulation.scene
        model = {name: np.array(getattr(scene.model, name), float) for name in MODEL_ARRAYS}
        numbers: list[NDArray[np.float64]] = []
        for field in dataclasses.fields(scene):
            _collect_numbers(getattr(scene, field.name), numbers)
        return {**model, "numbers": np.sort(np.concatenate(numbers))}

    def describe_model(self) -> dict[str, NDArray[np.float64]]:
        """Return the numbers that shields know of the robot, in their order."""
        numbers: list[NDArray[np.float64]] = []
        _collect_numbers(self._simulation.model, numbers)
        return {"model": np.concatenate(numbers)}

    def describe_contacts(self) -> dict[str, NDArray[np.float64]]:
        """Return which bodies may touch, how they look, and the settings of the physics."""
        model = self._simulation.scene.model
        arrays = {name: np.array(getattr(model, name), float) for name in CONTACT_ARRAYS}
        settings = {name: np.atleast_1d(np.array(getattr(model.opt, name), float))
                    for name in OPTIONS}  # fmt: skip
        drawn = {f"{part}/{name}": np.atleast_1d(np.array(getattr(getattr(model.vis, part), name)))
                 for part, names in DRAWING for name in names}  # fmt: skip
        return arrays | settings | drawn

    def describe_rig(self) -> dict[str, NDArray[Any]]:
        """Return which places the cameras see, and how many sentences there are on the rig."""
        scene = self._simulation.scene
        places = rigs.sample_workspace(scene.grounds)
        return {
            "places_m": places, "seen": rigs.find_visible(scene.cameras, scene.obstacles, places).T,
            "n_findings": np.array([len(rigs.describe_defects(scene))]),
        }  # fmt: skip

    def dress(self, appearance: str, seed: int) -> dict[str, NDArray[Any]]:
        """Return how an episode of an appearance looks to the cameras."""
        scene = self._simulation.scene
        built, model, worn = drawing_model(scene), drawing_model(scene), find_visuals(scene)
        rng = np.random.default_rng([seed, 49])
        look = looks.draw_look(looks.APPEARANCES[appearance], scene.n_workers, rng)
        looks.randomize(model, built, worn, look)
        looks.hide_hats(model, worn, look)
        drawn = mujoco.MjvScene(model, maxgeom=80)
        looks.add_litter(drawn, scene.grounds, look)
        litter = np.zeros((looks.MOST_LITTER, 19))
        for row, geom in zip(litter, drawn.geoms[: drawn.ngeom], strict=False):
            row[:] = [*geom.size, *geom.pos, *np.ravel(geom.mat), *geom.rgba]
        light = [model.light_dir, model.light_diffuse, model.light_specular]
        head = model.vis.headlight
        return {
            "look": np.concatenate([np.ravel(part) for part in look]),
            "light": np.concatenate([np.ravel(each) for each in light]),
            "headlight": np.concatenate([head.ambient, head.diffuse, head.specular]),
            "surfaces": model.mat_rgba.copy(), "pictures": model.mat_texid.copy(),
            "skins": model.skin_rgba.copy(), "groups": model.geom_group.copy(),
            "litter": litter, "n_litter": np.array(drawn.ngeom),
        }  # fmt: skip

    def view(self) -> NDArray[np.uint8]:
        """Return the scene from the viewpoint of people who look on."""
        base: Any = self._env.unwrapped
        return base.views.picture(markers=False)

    def picture(self) -> NDArray[np.uint8]:
        """Return the four cameras' images with crops and estimates drawn into them."""
        base: Any = self._env.unwrapped
        return base.mosaic()

    def close(self) -> None:
        """Release threads and graphics contexts."""
        self._env.close()

    def _as_named(self, info: dict[str, Any]) -> dict[str, Any]:
        """Return the numbers that were measured, and words instead of their indices."""
        named = {name: value.item() for name, value in info.items()
                 if _is_plain(name) and _are_measured(info, name)}  # fmt: skip
        named["is_success"] = bool(named["is_success"])
        named |= self._env.unwrapped.words(info)
        if "perception/more_people_than_slots" not in info:
            del named["perception/miscalibrated"]
        return named

    def _name_values(self, values: dict[str, Any], info: dict[str, Any]) -> dict[str, Any]:
        parts = self.observation if isinstance(self.observation, dict) else {}
        flat = parts.get("observation", self.observation)
        named = {f"observation/{name}": flat[part] for name, part in self._slices.items()}
        named |= {f"observation/{k}": v for k, v in parts.items() if k != "observation"}
        named |= {**values, **info}
        return {RENAMED.get(name, name): value for name, value in named.items()}


class Batch:
    """Some environments that are stepped at once, each beginning anew when its episode is over."""

    def __init__(self, env_id: str, n: int, n_steps: int, **options: Any) -> None:
        """Make n environments with episodes of so many steps; options are those of `Env`."""
        self._env = HRCVectorEnv(
            n, task=env_id, max_episode_steps=n_steps, num_threads=1, **_arguments(options)
        )
        self.action_shape = self._env.action_space.shape

    def reset(self, seed: int) -> dict[str, NDArray[Any]]:
        """Start all of them and return everything that is known then, (n, ...)."""
        observation, info = self._env.reset(seed=seed)
        self._over = np.zeros(self._env.num_envs, bool)
        return {"observation/all": _flat(observation), **_of_reset(_numeric(info))}

    def step(self, actions: NDArray[np.float32]) -> dict[str, NDArray[Any]]:
        """Act for one step and return everything that is known then, (n, ...)."""
        observation, reward, terminated, truncated, info = self._env.step(actions)
        ends = {"terminated": terminated, "truncated": truncated}
        numbers = _numeric(info)
        for name in {*numbers} - {*_of_reset(numbers)}:
            numbers[name] = np.where(self._over, 0.0, numbers[name])
        self._over = terminated | truncated
        return {"observation/all": _flat(observation), "reward": reward, **ends, **numbers}

    def make_agents(self, name: str) -> list[Callable[[Any], NDArray[np.float32]]]:
        """Return a policy of an agent for each environment: from observations to actions."""
        info = env_info(self._env.shards.first)
        return [make_agent(name, info, seed=k).act for k in range(self._env.num_envs)]

    def close(self) -> None:
        """Release threads."""
        self._env.close()


def _flat(observation: Any) -> NDArray[np.float32]:
    if not isinstance(observation, Mapping):
        return np.asarray(observation)
    return np.concatenate(list(observation.values()), axis=1)


def _numeric(infos: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """Return the numbers that some environment has measured, 0 for the others."""
    plain = [name for name in infos if name[0] != "_" and _is_plain(name)]
    known = {name: infos[f"_{name}"] & _are_measured(infos, name) for name in plain}
    named = {name: np.where(known[name], infos[name], 0.0) for name in plain if known[name].any()}
    if "is_success" in named:
        named["is_success"] = named["is_success"].astype(bool)
    return {RENAMED.get(name, name): value for name, value in named.items()}


FLAGS_OF = {name: entry.flag for name, entry in ENTRIES.items() if entry.flag}
"""The flags that say whether a number was measured."""


def _is_plain(name: str) -> bool:
    """Return whether a number stands neither for a word nor for the presence of another number, nor
    for what was drawn, of which all others tell."""
    words = name.startswith(("worker_", "perception/miscalibrated", "episode/"))
    return not words and name not in FLAGS_OF.values()


def _are_measured(infos: Mapping[str, Any], name: str) -> Any:
    """Return of which environments a number is one that was measured."""
    known = np.isfinite(infos[name])
    if name.startswith("safety/contact_") and name.endswith(("speed_m_s", "force_ratio")):
        return known & (infos["safety/contact_severity"] > 0)
    if name == "task/max_hand_force_n":
        return known & (infos[name] > 0)
    return known & (infos[FLAGS_OF[name]] > 0) if name in FLAGS_OF else known


def _of_reset(info: dict[str, Any]) -> dict[str, Any]:
    """Return what was known of resets at first: neither rewards nor what happens in a step."""
    later = ("reward/", "shield/", "safety/contact_", "safety/min_", "safety/robot_",
             "safety/worker_", "safety/too_", "safety/separation_", "safety/time_")  # fmt: skip
    kept = ("safety/contact_kind", "safety/contact_region")
    return {name: each for name, each in info.items() if name in kept or not name.startswith(later)}


def settings() -> dict[str, str]:
    """Return every setting's default by its place in the configuration, as "ID/task/radius_m"."""
    return {
        f"{place}/{_former_name(record, field.name)}": repr(getattr(record, field.name))
        for place, record in _records().items()
        for field in dataclasses.fields(record)
        if not _is_record(getattr(record, field.name))
    }


def _former_name(record: Any, name: str) -> str:
    """Return the name of a setting that the probes know, before it was renamed."""
    present = {new: old for old, new in getattr(record, "RENAMED", {}).items()}
    return present.get(name, name)


APPEARANCE_NAMES = tuple(looks.APPEARANCES)
ROBOT_NAMES = tuple(ROBOTS)


def presets() -> dict[str, NDArray[np.float64]]:
    """Return the numbers of every appearance and of every make of camera."""
    named = {f"appearance/{name}": each for name, each in looks.APPEARANCES.items()}
    named |= {f"make/{name}": each for name, each in MAKES.items()}
    values = {}
    for name, record in named.items():
        numbers: list[NDArray[np.float64]] = []
        _collect_numbers(record, numbers)
        values[name] = np.concatenate(numbers)
    return values


def spots_of(env_id: str, fields: Mapping[str, Any]) -> NDArray[np.float64]:
    """Return where a task with some settings has the tool get to: (n, 7), a place [m], a direction
    (0 if any will do), and how near is near enough [m]."""
    task = find_task(env_id)
    found = task(task.config_type(**fields)).reach_targets()
    spots = [each for each in found if each.name != MIDDLE]  # it refuses robots, and came later
    rows = [[*each.place_world, *(each.along_world or (0, 0, 0)), each.within_m] for each in spots]
    return np.array(rows, float).reshape(-1, 7)


def can_reach(
    robot: str, place_m: NDArray[np.float64], along: tuple[float, ...] | None, within_m: float
) -> bool:
    """Return whether a robot at the origin is thought to get its tool to a place."""
    target = ReachTarget("a place", place_m, along, within_m)
    try:
        check_reach("a probe", robot, make_chain(ROBOTS[robot], (0.0, 0.0, 0.0)), [target])
    except ConfigError:
        return False
    return True


def _records() -> dict[str, Any]:
    """Return all parts of the configuration, and what else holds settings, by place."""
    found: dict[str, Any] = {}

    def walk(place: str, record: Any) -> None:
        found[place] = record
        for field in dataclasses.fields(record):
            if _is_record(getattr(record, field.name)):
                walk(f"{place}/{field.name}", getattr(record, field.name))

    for env_id in ENV_IDS:
        walk(env_id, resolve_settings(task=env_id, config={}).config)
    for name, spec in ESTIMATORS.items():
        if spec.config is not None:
            walk(name, spec.config())
    walk("camera", CameraConfig("camera_1", (2.9, 2.6, 2.45)))
    return found | {f"shield_{name}": preset for name, preset in PRESETS.items()}


def _is_record(value: Any) -> bool:
    return dataclasses.is_dataclass(value) and not isinstance(value, type)


def compare_tracks(
    means_m: NDArray[np.float64],
    joints_m: NDArray[np.float64],
    tracked: NDArray[np.bool_],
    present: NDArray[np.bool_],
) -> dict[str, NDArray[np.float64]]:
    """Return the errors of tracks (T, W, J, 3) from workers (T, W, J, 3), and who was whose."""
    n_workers = means_m.shape[1]
    identities = metrics.make_identities(1, n_workers)
    prior = oracle.estimate_prior(1, n_workers, TrackerConfig())
    found = []
    for mean, joints, known, there in zip(means_m, joints_m, tracked, present, strict=True):
        estimate = dataclasses.replace(prior, mean_world=mean[None], tracked=known[None])
        capsules = np.zeros((1, n_workers, 1, 2, 3)), np.zeros((1, n_workers, 1))
        truth = WorkerTruth(joints[None], np.zeros_like(joints[None]), *capsules)
        found.append(
            metrics.measure_errors(estimate, truth.joints_world, there[None], identities)[0]
        )
    return {name: np.array([each[name] for each in found]) for name in metrics.TRACKING.names}


def objects_in_hand(
    env_id: str, poses: NDArray[np.float64], points_m: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return (n, O) which loose objects a closed and an open hand at points (n, 3) hold, where
    all objects are at poses (n, 7): place and quaternion."""
    env: Any = gymnasium.make(env_id, perception="none", disable_env_checker=True).unwrapped
    objects, n = env.simulation.scene.objects, len(poses)
    first, n_objects = objects.first, len(objects.names)
    qpos = np.zeros((n, first + 7 * n_objects))
    away = np.arange(n_objects)[:, None] * [0.02, 0, 0, 0, 0, 0, 0]
    qpos[:, first:] = (poses[:, None] + away).reshape(n, -1)
    held = [
        find_held(objects, qpos, points_m, HandState(np.zeros(n), np.zeros(n), closed))
        for closed in (np.ones(n, bool), np.arange(n) % 2 == 0)
    ]
    env.close()
    return np.concatenate(held, axis=1)


class Policy(NamedTuple):
    """A trained policy that comes with the package."""

    env_id: str
    name: str
    """As `Env.make_agent` takes it."""
    control: str


def policies() -> list[Policy]:
    """Return one trained policy of each id that has some."""
    found = {address.split("/")[2]: address for address in reversed(trained.list_names())}
    return [
        Policy(env_id, address, find_control(address) or "joint")
        for env_id, address in found.items()
    ]


def _collect_numbers(value: Any, found: list[NDArray[np.float64]]) -> None:
    """Append all numbers in a record, its records and containers."""
    if isinstance(value, np.ndarray) and value.dtype.names:
        for name in value.dtype.names:
            _collect_numbers(value[name], found)
    elif isinstance(value, np.ndarray | np.number | int | float):
        numbers = np.asarray(value)
        if numbers.dtype.kind in "fiub":
            found.append(numbers.astype(float).ravel())
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        for field in dataclasses.fields(value):
            _collect_numbers(getattr(value, field.name), found)
    elif isinstance(value, Mapping):
        for part in value.values():
            _collect_numbers(part, found)
    elif isinstance(value, tuple | list):
        for part in value:
            _collect_numbers(part, found)


def _renamed(fields: Mapping[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    return {names[name]: value for name, value in fields.items()}


def _put(config: dict[str, Any], path: str, value: Any) -> None:
    *branches, leaf = path.split(".")
    for branch in branches:
        config = config.setdefault(branch, {})
    config[leaf] = value


# --- Learning (learning.py) ----------------------------------------------------------------------


NOT_RECORDED = (
    "is_success", "proximity", "contacts_rated", "contacts_above_limit", "interventions",
    "approaches", "contact_steps", "contacts_per_hour", "contacts_towards_per_hour",
    "contacts_fleeing_per_hour", "contacts_standing_per_hour", "interventions_per_hour",
)  # fmt: skip
"""What curves, episodes and scores hold since the recordings were made."""


@contextlib.contextmanager
def intervals_of_few_seeds() -> Iterator[None]:
    """Let few or equal seeds have bootstrap intervals, as when the recordings were made."""
    from hrc_env.evaluation import episodes, intervals

    def estimate_goals(goals: Sequence[float], minutes: Sequence[float]) -> Any:
        estimate = intervals.estimate_ratio if any(goals) else intervals.estimate_rate
        return estimate(goals, minutes, "1/min")

    few = mock.patch.object(intervals, "MIN_SEEDS", 1)
    with few, mock.patch.object(episodes, "estimate_goal_rate", estimate_goals):
        yield


def _score(score: Any) -> dict[str, NDArray[np.float64]]:
    """Return a score, as it is recorded."""
    named = score.numbers().items()
    kept = {name: value for name, value in named if name not in NOT_RECORDED}
    return {f"score/{name}": np.array([float(value)]) for name, value in kept.items()}


def learn(
    algorithm: str, env_id: str, ends: tuple[int, ...], folder: Path, **options: Any
) -> dict[str, NDArray[np.float64]]:
    """Train a policy, judge it and export it; return the curves and what it is worth.

    Args:
        algorithm: a learner's name.
        env_id: a registered id.
        ends: environment steps at which runs end; each goes on with the one before.
        folder: an empty one. The policy is left in LEARNT and EXPORTED of it.
        options: other arguments of a training, by the command line's names.
    """
    from hrc_env.agents import export, training  # here, as in all of this part: they need PyTorch
    from hrc_env.agents.recipes import Run
    from hrc_env.agents.requests import ExportRequest

    torch_on_one_thread()
    console, values = Console(file=io.StringIO()), {}
    asked = Run(algorithm=algorithm, task=env_id, episodes=4, **options)
    for k, end in enumerate(ends):
        resumed = folder if k else None
        run = dataclasses.replace(asked, timesteps=end, out=folder, resume=resumed)
        for name, value in _columns(training.train(run, folder, console)[0]).items():
            if not name.endswith("_s") and name not in NOT_RECORDED:  # but for the clock's
                values[f"run_{k}/{name}"] = value
    values |= _score(training.judge(asked, folder, console))
    with contextlib.redirect_stdout(io.StringIO()), intervals_of_few_seeds():
        export.run(ExportRequest(run_folder=folder, name="probe", out=folder, episodes=4))
    (folder / env_id / "probe.safetensors").rename(folder / EXPORTED)
    card = folder / env_id / "probe.json"
    for name, metric in json.loads(card.read_text())["worth"][0].items():
        if isinstance(metric, dict):
            values[f"card/{name}"] = np.array([metric[each] for each in ("value", "low", "high")])
    card.rename((folder / EXPORTED).with_suffix(".json"))
    return values


def recipe_of(env_id: str, algorithm: str | None) -> dict[str, str]:
    """Return how a task is learnt by a learner, or by its own if None, where nothing is asked."""
    from hrc_env.agents.recipes import fill_in
    from hrc_env.agents.requests import TrainingRequest

    run = fill_in(TrainingRequest(task=env_id, algorithm=algorithm))
    return {name: str(getattr(run, field)) for name, field in RECIPE_FIELDS.items()}


RECIPE_FIELDS = {
    name: name
    for name in (
        "algorithm", "control", "demonstrations", "timesteps", "proximity", "num_envs", "seed",
        "perception", "ramp", "episodes", "her", "cost_limit",
    )
}  # fmt: skip
"""Names of the probes for arguments of a training, and today's fields."""
LEARNT, EXPORTED = "policy.zip", "exported.safetensors"


def clone(
    env_id: str, control: str, seed: int, n_rounds: int, n_steps: int
) -> dict[str, NDArray[np.float64]]:
    """Teach a policy what the scripted agent does; return its errors and what it does then."""
    from hrc_env.agents import cloning, ppo
    from hrc_env.sb3 import HRCVecEnv

    torch_on_one_thread()
    env = HRCVecEnv(16, task=env_id, perception="keypoints", control=control, seed=seed)
    policy = ppo.make_learner(env, ppo.IMITATOR, seed).policy
    settings = cloning.CloningSettings(rounds=n_rounds, steps=n_steps)
    shares: list[float] = []
    errors = cloning.clone(policy, env, 4, settings, seed, shares.append)
    env.seed(seed)
    acts, observation = [], env.reset()
    for _ in range(8):
        acts.append(policy.predict(observation, deterministic=True)[0])  # type: ignore[arg-type]
        observation = env.step(acts[-1])[0]
    env.close()
    log_std: Any = policy.log_std
    return {
        "errors": np.array(errors), "acts": np.array(acts), "share": np.array([sum(shares)]),
        "log_std": log_std.detach().numpy(),
    }  # fmt: skip


def record_episodes(
    env_id: str, agent: str, n_episodes: int, seed: int
) -> list[dict[str, NDArray[Any]]]:
    """Return the episodes of a data set that an agent recorded, two at a time."""
    import minari

    from hrc_env.agents import recording
    from hrc_env.agents.requests import RecordingRequest

    name, before = "hrc/probe-v0", os.environ.get(recording.ROOT)
    with tempfile.TemporaryDirectory() as place, contextlib.redirect_stdout(io.StringIO()):
        os.environ[recording.ROOT] = place
        try:
            recording.run(RecordingRequest(task=env_id, agent=agent, episodes=n_episodes, seed=seed,
                                 out=name, num_envs=2))  # fmt: skip
            found = list(minari.load_dataset(name).iterate_episodes())
        finally:
            os.environ.pop(recording.ROOT)
            os.environ |= {} if before is None else {recording.ROOT: before}
    return [
        {
            **(each.observations if isinstance(each.observations, dict)
               else {"observation": each.observations}),
            "actions": each.actions, "rewards": each.rewards, "cost": each.infos["cost"],
            "success": each.infos["is_success"],
            "ends": np.array([each.terminations, each.truncations]),
        }
        for each in found
    ]  # fmt: skip


def judge_agent(
    env_id: str, agent: str, n_episodes: int, one_by_one: bool, **options: Any
) -> dict[str, NDArray[np.float64]]:
    """Return the statistics of an agent's episodes, and its score."""
    from hrc_env.evaluation import episodes as played

    play = played.play_one_by_one if one_by_one else played.play_episodes
    make = functools.partial(make_agent, agent)
    options = {"task": env_id, "perception": "keypoints", **options}
    shares: list[float] = []
    episodes = play(make, n_episodes, played.EVALUATION_SEED, tick=shares.append, **options)
    with intervals_of_few_seeds():
        worth = played.measure(episodes)
    return {
        **_columns(episodes),
        "progress": np.cumsum(shares),
        **_score(played.summarize(episodes)),
        **{f"worth/{k}": np.array([v.value, v.low, v.high], float) for k, v in worth.items()},
    }


def torch_on_one_thread() -> None:
    """Let PyTorch round as it does in trainings."""
    import torch

    torch.set_num_threads(1)


def _columns(rows: Sequence[Mapping[str, float]]) -> dict[str, NDArray[np.float64]]:
    left_out = {"t", *NOT_RECORDED}  # the first is the clock's
    names = [name for name in rows[0] if name not in left_out] if rows else []
    return {name: np.array([float(each[name]) for each in rows]) for name in names}


# --- Motion (motion.py) --------------------------------------------------------------------------

BODY_NAMES = bodies.worker_names()
"""Every baked body."""
SCENE_NAMES = tuple(repertoire.SCENES)
"""Everything that a worker can be shown to do alone."""
PROP_KINDS = props.PROP_NAMES
"""Everything that can be held; the first is nothing."""
PEOPLE_KINDS = tuple(motion_config.PEOPLE)
ACTIVITIES = motion.activity_names
PEOPLE_FIELDS = {
    name: name
    for name in (
        "notice_m", "fast_m_s", "delay_s", "pause_probability", "step_back_probability", "pause_s",
        "calm_s", "detour_m", "speed_m_s", "tempo", "sudden_probability", "lunge_probability",
        "stumble_probability", "fall_probability", "lie_s", "stay_down_probability",
        "run_probability", "run_m_s", "careless_probability",
    )
}  # fmt: skip
MOTION_FIELDS = {
    name: name
    for name in (
        "near_probability", "near_radius_m", "near_azimuth_rad", "dwell_s", "spacing_m",
        "near_pause_s", "away_pause_s", "target_radius_m", "target_z_m", "target_spread_rad",
        "hand_speed_m_s", "sudden_speed_m_s", "two_hands_probability", "hold_s", "lift_s",
        "load_z_m", "motions_probability",
    )
}  # fmt: skip
SEGMENT_NAMES = bodies.SEGMENTS
Arrays = dict[str, NDArray[Any]]


def default_settings() -> Arrays:
    """Return the numbers of the workers' settings, and of every kind of people."""
    plain = motion_config.MotionConfig()
    numbers = {f"motion/{name}": getattr(plain, field) for name, field in MOTION_FIELDS.items()}
    scripted = "adversary"  # other people with a script: as many numbers as "unaware", the same
    for kind, people in motion_config.PEOPLE.items():
        if kind == scripted:
            continue
        for name, field in PEOPLE_FIELDS.items():
            numbers[f"{kind}/{name}"] = getattr(people, field)
    return {name: np.atleast_1d(np.array(value, float)) for name, value in numbers.items()}


def list_jobs(work: str) -> Arrays:
    """Return a choice of jobs: of each its activity, place, prop and numbers, and what follows."""
    jobs = schedule.WORK[work]
    words = [(job.name, job.activity, job.at, job.prop, job.by) for job in jobs]
    numbers = [(job.begins, job.height_m, job.waits) for job in jobs]
    follows = [" ".join(f"{name}:{weight:g}" for name, weight in job.then) for job in jobs]
    return {
        "words": np.array(words, "U"),
        "numbers": np.array(numbers, float),
        "follows": np.array(follows, "U"),
    }


def measure_body(name: str) -> Arrays:
    """Return the measures of a baked body, each (1, ...) [m]."""
    body = bodies.load_body(name)
    bones = measure_anatomy(body)
    measures = {
        "stature_m": body.stature_m,
        "rest_m": body.rest_position,
        "joint_segment": body.joint_segment,
        "joint_offset_m": body.joint_offset,
        "capsule_segment": body.capsule_segment,
        "capsule_ends_m": body.capsule_ends,
        "capsule_radius_m": body.capsule_radius_m,
        "bone_offset_m": bones.offset,
        "bone_frame": bones.frame,
        "sizes_m": bones.lengths,
        "rounds": bones.trunk_ends,
    }
    return {key: np.asarray(value)[None] for key, value in measures.items()}


def pose_body(name: str, controls: NDArray[np.float64]) -> Arrays:
    """Return where the segments of a body are in poses (T, controls)."""
    position, turn, _ = pose_segments(controls, measure_anatomy(bodies.load_body(name)))
    return {"position_m": position, "turn": turn}


def perform_scene(
    name: str, body: str, place: tuple[float, float, float], is_right: bool, seed: int,
    every_s: float, height_m: float | None = None,
) -> Arrays:  # fmt: skip
    """Return what a worker alone does in a scene of the repertoire, moment by moment; at another
    height than usual if one is given."""
    me = repertoire.make_worker(bodies.load_body(body), place[:2], place[2], is_right)
    rng = np.random.default_rng(seed)
    acts = repertoire.SCENES[name]
    if height_m is not None:
        acts = tuple(act._replace(height_m=height_m) for act in acts)
    return _join_films(repertoire.perform(acts, me, rng, every_s))


def perform_reaches(
    body: str, is_near: bool, height_m: float, others_m: NDArray[np.float64], is_right: bool,
    seed: int, n_acts: int, every_s: float,
) -> Arrays:  # fmt: skip
    """Return reaches one after the other of a worker beside the robot, or elsewhere."""
    config = motion_config.MotionConfig(people=motion_config.PeopleConfig(sudden_probability=0.3))
    numbers = motion_config.make_hand_params(config, Point(0.0, 0.0))
    reach, lift = ACTIVITIES.index("reach"), ACTIVITIES.index("lift")

    def start_reach(draws: Any, height: float, me: Any) -> float:
        return starting.start_reach(draws, numbers, is_near, height, others_m, me)

    def start_lift(draws: Any, height: float, me: Any) -> float:
        return starting.start_lift(draws, numbers, me)

    me = repertoire.make_worker(bodies.load_body(body), (1.15, 0.1), np.pi + 0.1, is_right)
    reaches = repertoire.Act(reach, start_reach, height_m)
    acts = [reaches, repertoire.Act(lift, start_lift, 0.0)] * n_acts
    return _join_films(repertoire.perform(acts, me, np.random.default_rng(seed), every_s))


def _join_films(films: Any) -> Arrays:
    motions = [film.motion for film in films]
    return {
        "activity": np.concatenate([np.full(len(f.time_s), f.activity) for f in films]),
        "time_s": np.concatenate([film.time_s for film in films]),
        "controls": np.concatenate([film.controls for film in films]),
        "position_m": np.concatenate([each.position_world[:, 0] for each in motions]),
        "turn": np.concatenate([each.quaternion_wxyz[:, 0] for each in motions]),
        "velocity_m_s": np.concatenate([each.velocity_world[:, 0] for each in motions]),
        "held": np.concatenate([each.held.kind[:, 0] for each in motions]),
        "held_m": np.concatenate([each.held.position_world[:, 0] for each in motions]),
        "held_turn": np.concatenate([each.held.quaternion_wxyz[:, 0] for each in motions]),
    }


def place_body(names: tuple[str, ...], rows: NDArray[np.int64], segments: Arrays) -> Arrays:
    """Return joints, their velocities and capsules of bodies (N,) whose segments are given."""
    body, now = bodies.load_bodies(names), _motion_of(segments, rows)
    truth = bodies.worker_truth(body, now)
    path = WorkerPath(now.position_world[:, None], now.quaternion_wxyz[:, None])
    return {
        "joints_m": truth.joints_world[:, 0],
        "joint_speed_m_s": truth.velocity_world[:, 0],
        "capsules_m": truth.capsules_world[:, 0],
        "radius_m": truth.capsule_radius_m[:, 0],
        "path_m": bodies.worker_capsules(body, path, rows[:, None])[:, 0, 0],
    }


def _motion_of(segments: Arrays, rows: NDArray[np.int64] | None = None) -> WorkerMotion:
    names = ("position_m", "turn", "velocity_m_s", "turning_rad_s")
    return WorkerMotion(
        *(np.ascontiguousarray(segments[name], float)[:, None] for name in names),
        body=None if rows is None else rows[:, None],
    )


def shape_props(kind: Any, position_m: Any, turn: Any) -> NDArray[np.float64]:
    """Return the solid parts of what is held (B, W), in the world."""
    return props.held_shapes(Held(kind, position_m, turn))


def bound_props() -> NDArray[np.float64]:
    """Return the boxes round all props, and where hands grip them (P, 4, 3) [m]."""
    grips = np.stack([prop.grips for prop in props.PROPS])
    return np.concatenate([props.BOUNDS_M, grips], axis=1)


def make_clip_of(controls: Any, contacts: Any, size_m: Any, fps: float, source: str) -> Any:
    """Return a clip of control vectors (T, 47), which feet stand and lengths; None: refused."""
    with contextlib.suppress(ConfigError):
        return Clip(controls, fps, contacts, size_m, source)
    return None


def write_clip(clip: Any, path: Path) -> None:
    """Write a clip to a file."""
    save_clip(clip, path)


def read_clip(path: Path) -> Any:
    """Return the clip that a file holds; None: refused."""
    with contextlib.suppress(ConfigError):
        return load_clip(path)
    return None


def time_pieces(clips: Any, names: tuple[str, ...], place: str) -> float:
    """Return how long the pieces last into which clips are cut for bodies in a place [s]."""
    sizes = np.stack([measure_anatomy(bodies.load_body(name)).lengths for name in names])
    plan = floorplan.make_floorplan(Floor(place).grounds)
    return cut_into_pieces(clips, sizes, make_stage(plan, motion_config.MotionConfig())).duration_s


def list_clip(clip: Any) -> Arrays:
    """Return what a clip holds, and its controls from the origin on."""
    return {
        "controls": clip.controls, "contacts": clip.contacts, "size_m": clip.size,
        "at_origin": move_to_origin(clip.controls), "fps": np.array([clip.fps]),
        "source": np.array([clip.source], "U"),
    }  # fmt: skip


class Floor:
    """The floor of a place, on which ways are found."""

    def __init__(self, place: str) -> None:
        """Measure the floor of "lab", "site" or "open"."""
        self.grounds = motion.OPEN_FLOOR if place == "open" else build_scene(name=place).grounds
        self._plan = floorplan.make_floorplan(self.grounds)
        self.x_m, self.y_m = self.grounds.walkable_x_m, self.grounds.walkable_y_m
        self.robot_m = self.grounds.robot_xy_m

    def describe(self) -> Arrays:
        """Return what is on the floor: robot, footprints, places, and how many find room."""
        grounds = self.grounds
        at = [(*p.xy_m, p.yaw_rad, p.height_m, p.ahead_m) for p in grounds.places]
        words = [" ".join((p.kind, *p.loads)) for p in grounds.places]
        limits = [*self.x_m, *self.y_m, *grounds.robot_xy_m, grounds.robot_clearance_m]
        apart = (0.8, 1.1, 2.0)
        return {
            "limits_m": np.array([limits]),
            "blocked_m": np.asarray(grounds.blocked, float).reshape(1, -1),
            "places": np.array(at),
            "kinds": np.array(words, "U"),
            "room_for": np.array([floorplan.count_room(self._plan, m) for m in apart]),
        }

    def measure_slack(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the room (N,) round points (N, 2) [m]."""
        plan = self._plan
        slack = [floorplan.read_slack(x, y, plan.grid) for x, y in points_m.tolist()]
        return np.array(slack)

    def lay_loads(self, seed: int) -> Arrays:
        """Return the loads that lie about at first, and a little off their places."""
        first = lying.make_loads(self.grounds.places, schedule.JOBS)
        laid = np.zeros(len(first) + 1, first.dtype)
        lying.reset_loads(laid, first, np.random.default_rng(seed))
        return {
            "first": first["pose"].copy(), "shown": laid["shown"].copy(),
            "stand": laid["stand"].copy(), "at": laid["at"].copy(),
            "free": lying.find_uncovered(laid), "in_the_way": lying.list_load_discs(laid),
        }  # fmt: skip

    def find_way(
        self, start_m: Any, end_m: Any, bow: float, discs: NDArray[np.float64],
        shares: NDArray[np.float64],
    ) -> Arrays:  # fmt: skip
        """Return whether there is a way past discs (n, 3), and its points and directions at shares
        of its length."""
        me, plan = repertoire.make_worker(bodies.load_body()), self._plan
        ends = Point(*map(float, start_m)), Point(*map(float, end_m))
        found = routes.find_route(*ends, bow, discs, plan.grid, me)
        ways = [
            (*paths.locate_on_path(s, me), paths.average_heading(s, me))
            for s in shares * me["length"]
        ]
        facts = float(me["length"]), float(me["sharpest"]), float(me["n_pieces"])
        way = np.array(ways) if found else np.full((len(shares), 3), np.nan)
        return {"found": found, "way": way, "facts": np.array(facts if found else (0.0,) * 3)}


class Crew:
    """Workers of a few environments, who go about their work."""

    def __init__(
        self, place: str, batch: int, n_workers: int, names: tuple[str, ...], people: Any,
        seed: int, *, work: str = "framing", fewest: int | None = None, girth_m: float = 0.0,
        settings: Mapping[str, Any] | None = None, more_places: tuple[Any, ...] = (),
        clips: tuple[Any, ...] = (),
    ) -> None:  # fmt: skip
        """Put workers in a place ("lab", "site", "open").

        Args:
            people: a kind, or changes of the attentive ones by names of `PEOPLE_FIELDS`.
            settings: changes of the rest, by names of `MOTION_FIELDS`.
            more_places: kind, x, y, yaw, height and loads of each place that is added.
            clips: recorded motion that they play.
        """
        kinds = motion_config.PEOPLE
        if not isinstance(people, str):
            people = dataclasses.replace(kinds["attentive"], **_renamed(people, PEOPLE_FIELDS))
        config = motion_config.MotionConfig(
            people=kinds[people] if isinstance(people, str) else people,
            jobs=schedule.WORK[work], motions=clips, **_renamed(settings or {}, MOTION_FIELDS),
        )  # fmt: skip
        grounds = Floor(place).grounds
        more = tuple(
            Workplace(f"more {k}", kind, (x, y), yaw, height, loads=loads)
            for k, (kind, x, y, yaw, height, loads) in enumerate(more_places)
        )
        grounds = dataclasses.replace(grounds, places=(*grounds.places, *more))
        self.robot_m = grounds.robot_xy_m
        self.names, self._body = names, bodies.load_bodies(names)
        self._state = motion.make_state(
            batch, n_workers, self._body, config, grounds, fewest, girth_m
        )
        self._rngs = [np.random.default_rng([seed, b]) for b in range(batch)]
        motion.reset(self._state, np.arange(batch), self._rngs)
        self._now = motion.current(self._state)

    def go_on(self, step_s: float, n_steps: int) -> None:
        """Let time go on by a number of steps."""
        self._path, self._now = motion.advance(self._state, self._rngs, step_s, n_steps)

    def look_at_robot(
        self,
        points_m: NDArray[np.float64],
        since_s: float,
        stage: Any = None,
        offered_m: Any = None,
    ) -> None:
        """Show everybody two points of the robot (B, 2, 3), and how far the task has come (B,)."""
        cue = None if stage is None else WorkerSignal(stage, offered_m)
        motion.watch(self._state, points_m, self._now, since_s, cue)

    def move(self) -> Arrays:
        """Return the bodies now: arrays (B, W, ...), and what they are about."""
        now, held, workers = self._now, self._now.held, self._state.workers
        fields = {
            "job": "job", "going": "travel", "at": "place_kind", "doing": "current_reaction",
            "reaction": "planned_reaction", "time_s": "time_s", "duration_s": "duration_s",
            "pace": "pace", "spot": "place",
        }  # fmt: skip
        return {
            "activity": motion.activity(self._state),
            "position_m": now.position_world,
            "turn": now.quaternion_wxyz,
            "velocity_m_s": now.velocity_world,
            "turning_rad_s": now.angular_velocity_world,
            "body": now.body,
            "held": held.kind, "held_m": held.position_world, "held_turn": held.quaternion_wxyz,
            "path_m": self._path.position_world,
            **{f"plan/{name}": np.array(workers[field]) for name, field in fields.items()},
        }  # fmt: skip

    def list_deeds(self) -> Arrays:
        """Return what they have done for a task, (B, W, ...)."""
        done = motion.progress(self._state, self._now)
        return {
            "present": done.present, "screws": done.screws, "boring": done.boring,
            "takes": done.takes, "grip_m": done.grip_world,
            "grip_m_s": done.grip_velocity_world,
        }  # fmt: skip

    def see(self) -> Arrays:
        """Return joints, their velocities, capsules and radii of the bodies now, (B, W, ...)."""
        truth = bodies.worker_truth(self._body, self._now)
        return {
            "joints_m": truth.joints_world, "joint_speed_m_s": truth.velocity_world,
            "capsules_m": truth.capsules_world, "radius_m": truth.capsule_radius_m,
        }  # fmt: skip

    def meet(self) -> NDArray[np.float64]:
        """Return when and where workers would come too near to another if those of all environments
        were in one, (B W, 3)."""
        everyone = self._state.workers.reshape(-1)
        return np.array([find_meeting(w, everyone) for w in range(len(everyone))], float)


# --- Tracker and geometry (tracker.py) -----------------------------------------------------------

TRACKER_SETTINGS: dict[str, str] = {
    name: (ParticleConfig.RENAMED | PaperConfig.RENAMED).get(name, name)
    for name in (
        "prior_mean_world", "prior_std_m", "lost_after_s", "forget_s", "longest_delay_s",
        "acquire_min_joints", "sigma_scale", "noise_bounds", "noise_share", "wait_updates",
        "stands_std_m", "mirrored_parts", "gauss_newton_steps", "n_hypotheses", "n_particles",
        "n_iterations", "place_m", "sigma_m", "look_every_s", "open_depth_m", "turn_std_rad",
        "evidence_trust", "least_weight",
    )
}  # fmt: skip
"""Names of the probes for settings of estimators, and today's fields."""


class Tracker:
    """An estimator with its state, for several places and workers."""

    def __init__(
        self, estimator: str, P: NDArray[np.float64], step_s: float, shape: tuple[int, int],
        settings: Mapping[str, Any], seed: int = 0,
    ) -> None:  # fmt: skip
        """Begin `shape` (places, workers) of an estimator by its name."""
        kind = find_estimator(estimator).config
        config = kind(**{TRACKER_SETTINGS[name]: value for name, value in settings.items()})
        self._made, self._P = make_estimator(estimator, P, step_s, config), P
        self._rngs = [np.random.default_rng([seed, b]) for b in range(shape[0])]
        self._state = self._made.init(*shape)
        self.reset(np.arange(shape[0]))

    def reset(self, places: NDArray[np.int64]) -> None:
        """Forget some places."""
        self._made.reset(self._state, places, self._rngs)

    def predict(self, step_s: float) -> None:
        """Let time pass."""
        self._made.predict(self._state, step_s, self._rngs)

    def update(self, seen: Mapping[str, Any]) -> None:
        """Take one set of frames in."""
        self._made.update(self._state, _as_keypoints(seen), self._rngs)

    def estimate(self) -> dict[str, NDArray[Any]]:
        """Return the belief of now."""
        return _as_values(self._made.estimate(self._state))

    def forecast(self, horizon_s: float) -> dict[str, NDArray[Any]]:
        """Return the belief of a time ahead."""
        return _as_values(self._made.forecast(self._state, horizon_s))

    def assign_people(self, seen: Mapping[str, Any]) -> tuple[dict[str, Any], NDArray[np.int64]]:
        """Return frames sorted by worker, and the index of the pose that each one got."""
        found = associate(self._P, _as_keypoints(seen), self._made.estimate(self._state))
        return _as_frames(found.keypoints), found.pose

    def count_ignored(self) -> NDArray[np.int64]:
        """Return how many late frames were left out, by reason."""
        return self._state.ignored.copy()

    def hypotheses(self) -> dict[str, NDArray[Any]]:
        """Return what an estimator with hypotheses holds besides its belief."""
        state = getattr(self._state, "now", self._state)
        best, views, noise = state.trees[:, :, 0], state.views[:, :, 0], state.noise[:, :, 0]
        alive = np.arange(state.trees.shape[2]) < state.n_alive[..., None]
        return {
            "count": state.n_alive.copy(),
            "log_weight": np.where(alive, state.trees["log_weight"], 0.0),
            "pose_log_prior": np.where(alive, state.trees["pose_log_prior"], 0.0),
            "waited_s": state.since_search_s.copy(),
            "waited_updates": best["one_view_updates"].copy(),
            "conflicts": best["conflict"].copy(),
            "size_std": best["size_std"].copy(),
            "bone_m": best["bone_length"].copy(),
            "bone_std_m": np.sqrt(best["bone_variance"]),
            "offset_m": best["offset"].copy(),
            "offset_count": best["offset_count"].copy(),
            "slope": best["slope"].copy(),
            "speed_std": np.sqrt(np.diagonal(best["cov"], axis1=-2, axis2=-1)[..., 3:]),
            "swap_chance": views["swap_chance"].copy(),
            "blind": views["unseen_updates"].copy(),
            "believed": views["trusted_updates"].copy(),
            "noise_factor": noise["factor"].copy(),
            "noise_sums": noise["sums"].copy(),
            "turn_rad": best["pair"]["turn"].copy(),
            "turn_std_rad": np.sqrt(
                np.diagonal(best["pair"]["turn_cov"], axis1=-2, axis2=-1).clip(0)
            ),
            "turn_fits": best["pair"]["meeting_share"].copy(),
            "is_askew": best["pair"]["is_misaligned"].copy(),
            "pair_waited": best["pair"]["untracked_updates"].copy(),
            "displaced_m": np.sqrt(np.diagonal(best["displaced_m2"], axis1=-2, axis2=-1).clip(0)),
        }


def _as_keypoints(seen: Mapping[str, Any]) -> Keypoints:
    return Keypoints(seen["px"], seen["confidence"], seen["sigma_px"], seen.get("time_s"))


def _as_frames(keypoints: Keypoints) -> dict[str, Any]:
    found = {"px": keypoints.px, "confidence": keypoints.confidence}
    found |= {"sigma_px": keypoints.sigma_px}
    return found if keypoints.time_s is None else found | {"time_s": keypoints.time_s}


def _as_values(estimate: PoseEstimate) -> dict[str, NDArray[Any]]:
    return {
        "mean_world": estimate.mean_world,
        "cov_world": estimate.cov_world,
        "velocity_world": estimate.velocity_world,
        "age_s": estimate.age_s,
        "tracked": estimate.tracked,
        "unknown": estimate.unknown,
        "blind_s": estimate.unobserved_s,
        "seen_world": estimate.seen_world,
    }


def _as_estimate(belief: Mapping[str, Any]) -> PoseEstimate:
    names = ("mean_world", "cov_world", "velocity_world", "age_s", "tracked", "unknown", "blind_s",
             "seen_world")  # fmt: skip
    return PoseEstimate(*(belief.get(name) for name in names))


def find_unexplained_people(
    P: NDArray[np.float64], focal_px: NDArray[np.float64], seen: Mapping[str, Any],
    age_s: NDArray[np.float64], belief: Mapping[str, Any],
) -> dict[str, NDArray[np.bool_]]:  # fmt: skip
    """Return the cameras (B, C) that show people, and people whom no track explains."""
    found = find_unexplained(_as_keypoints(seen), age_s, _as_estimate(belief), P, focal_px)
    return {"poses": found.poses, "unexplained": found.unexplained}


def associate_people(
    P: NDArray[np.float64], belief: Mapping[str, Any], seen: Mapping[str, Any]
) -> NDArray[np.int64]:
    """Return which pose (B, C, W) of each camera is of which worker; -1: none."""
    return associate(P, _as_keypoints(seen), _as_estimate(belief)).pose


def forecast_belief(belief: Mapping[str, Any], horizon_s: float) -> dict[str, NDArray[Any]]:
    """Return a belief of a time ahead, if nobody looks."""
    return _as_values(forecast(_as_estimate(belief), horizon_s, TrackerConfig()))


def smooth_clip(
    P: NDArray[np.float64], clip: list[dict[str, Any]], step_s: float
) -> dict[str, NDArray[Any]]:
    """Return the offline belief of every frame of a clip."""
    return _as_values(smooth(P, [_as_keypoints(seen) for seen in clip], step_s))


def believe_truth(joints_world: NDArray[Any], velocity_world: NDArray[Any]) -> dict[str, Any]:
    """Return the belief that is made of the truth (places, workers, joints, 3)."""
    none = np.zeros((*joints_world.shape[:2], 0, 2, 3))
    truth = WorkerTruth(joints_world, velocity_world, none, none[..., 0, 0])
    return _as_values(oracle.estimate_from_truth(truth))


def believe_prior(shape: tuple[int, int]) -> dict[str, Any]:
    """Return the beliefs in nobody, and in whoever may be there."""
    nobody = oracle.estimate_absence(*shape, TrackerConfig())
    prior = oracle.estimate_prior(*shape, TrackerConfig())
    return {f"{kind}/{name}": value for kind, each in (("nobody", nobody), ("prior", prior))
            for name, value in _as_values(each).items()}  # fmt: skip


class Presence:
    """What is known of slots without a track, for several places."""

    def __init__(
        self, shape: tuple[int, int], n_cameras: int, step_s: float,
        sees: NDArray[np.bool_] | None = None,
    ) -> None:  # fmt: skip
        """Begin, before anybody has looked; `sees` (G, C) are the cameras of each piece of floor,
        all of one piece if it is not given."""
        sees = np.ones((1, n_cameras), np.bool_) if sees is None else sees
        n = len(sees)
        seen = Coverage(np.zeros((n, 3)), 0.1, np.arange(n), sees)
        self._known, self._step_s = presence.Presence(*shape, seen), step_s

    def forget(self, places: NDArray[np.int64]) -> None:
        """Begin some places anew."""
        self._known.forget(places)

    def look(
        self, belief: Mapping[str, Any], found: Mapping[str, Any], own: Mapping[str, Any],
        looked: NDArray[np.bool_], age_s: NDArray[np.float64], by_search: bool,
        shown: NDArray[np.bool_] | None = None, unexplained: NDArray[np.bool_] | None = None,
        others_m: NDArray[np.float64] | None = None,
    ) -> dict[str, NDArray[Any]]:  # fmt: skip
        """Return the belief with whom is unknown, after one look of every camera.

        Cameras (B, C) may show people whom a track explains or not; people beyond the slots are
        at `others_m` (B, N, 3), NaN where there are fewer.
        """
        enough = presence.SEARCHES if by_search else presence.IMAGES
        nobody = np.zeros_like(looked)
        poses = DetectedPoses(*(nobody if each is None else each for each in (shown, unexplained)))
        others = no_others(len(looked))
        if others_m is not None:
            others = Others(others_m, np.where(np.isnan(others_m[..., 0]), np.inf, 0.0))
        searches = presence.ImageSearches(looked, age_s, enough, poses, others)
        said = self._known.update(
            np.arange(len(looked)), _as_estimate(belief), _as_keypoints(found), _as_keypoints(own),
            searches, self._step_s, TrackerConfig(),
        )  # fmt: skip
        return _as_values(said)

    def describe_floor(self) -> dict[str, NDArray[Any]]:
        """Return the level (B, W, G) of each piece of floor, the age of its looks, and the cameras
        (B, C) that contradict the calibration."""
        ids = np.arange(len(self._known.doubt))
        floor = self._known.vacancy(ids)
        return {"level": floor.level, "level_age_s": floor.age_s,
                "contradicted": self._known.find_contradicting_cameras(ids)}  # fmt: skip


class Watchers:
    """What is thought of cameras: whether they are stuck, or not where they should be."""

    def __init__(self, batch: int, P: NDArray[np.float64], axes_px: NDArray[np.float64]) -> None:
        """Begin with cameras (C, 3, 4) and their principal points and focal lengths (C, 3)."""
        self._P, self._axes_px, self._ids = P, axes_px, np.arange(batch)
        self._frozen = make_frozen(batch, len(P))
        self._monitored = make_monitor(batch, len(P))

    def leave_out_stuck(self, seen: dict[str, Any]) -> NDArray[np.bool_]:
        """Take stuck cameras' frames out, in place, and return which cameras are believed."""
        leave_out_frozen(self._frozen, self._ids, _as_keypoints(seen))
        return find_live_cameras(self._frozen, self._ids)

    def monitor(
        self, seen: Mapping[str, Any], age_s: NDArray[np.float64], belief: Mapping[str, Any]
    ) -> dict[str, NDArray[Any]]:
        """Count one update, and return what is thought of the cameras' places."""
        monitor(
            self._monitored, self._ids, _as_keypoints(seen), age_s, _as_estimate(belief), self._P,
            self._axes_px,
        )  # fmt: skip
        names = ("ratio", "suspected", "score")
        return {name: self._monitored[name].copy() for name in names}

    def forget(self, places: NDArray[np.int64]) -> None:
        """Begin some places anew."""
        forget_monitor(self._monitored, places)
        forget_frozen(self._frozen, places)


class Camera:
    """A camera with its lens, as the package makes it from a description."""

    def __init__(
        self, lens: str = "none", coefficients: tuple[float, ...] = (), **described: Any
    ) -> None:
        """Hang a camera up; `described` has the names of `CAMERA_FIELDS`, focal and centre."""
        names = CAMERA_FIELDS | {"focal_px": "focal_px", "centre_px": "centre_px"}
        fields = {names[name]: value for name, value in described.items()}
        config = CameraConfig(name="probe", lens=Lens(lens, coefficients), **fields)
        self._made = make_cameras((config,))[0]
        self.K, self.P = self._made.K, self._made.P
        self.pose, self.eye_world = self._made.T_world_from_cam, self._made.eye_world
        self.lens_row = lens_row(config.lens).copy()

    def rays(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return unit directions in the world of pixels of the image."""
        return cameras.rays(self._made, pixels)

    def to_image(self, pinhole_px: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return pixels of the image of a pinhole's."""
        return cameras.image_from_pinhole(self._made, pinhole_px)

    def to_pinhole(self, image_px: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a pinhole's pixels of the image's."""
        return cameras.pinhole_from_image(self._made, image_px)

    def magnification(self, pinhole_px: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how many times longer a pinhole shows things."""
        times = cameras.pinhole_magnification(self._made, pinhole_px)
        return np.broadcast_to(times, pinhole_px.shape[:-1])

    def shows(self, pixels: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which pixels lie in the image."""
        return cameras.inside_image(self._made, pixels)

    def resized(self, width_px: int, height_px: int) -> NDArray[np.float64]:
        """Return the intrinsics of the camera with another image."""
        return cameras.resize(self._made, width_px, height_px).K


def project_points(
    P: NDArray[np.float64], points_world: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return pinhole pixels and depths of points in every camera."""
    return cameras.project(P, points_world)


def meet_planes(
    P: NDArray[np.float64], px: NDArray[np.float64], use: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the points nearest to the planes of views px (n, C, 2), and whether there are any."""
    points, are_found = np.zeros((len(px), 3)), np.zeros(len(px), bool)
    for k in range(len(px)):
        are_found[k] = linear_point(P, px[k], use[k], points[k])
    return points, are_found


def triangulate_views(
    P: NDArray[np.float64], px: NDArray[np.float64], sigma_px: NDArray[np.float64], gate: float
) -> dict[str, NDArray[Any]]:
    """Return points of all views, or of those that agree within the gate."""
    made = triangulate(P, px, sigma_px, gate)
    return {"points_world": made.points_world, "cov_world": made.cov_world, "used": made.used}


def lines_of_sight(
    P: NDArray[np.float64], pixels: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Return what rays of pixels (n, C, 2) of the first two cameras are, and where they pass."""
    rig = np.zeros(len(P), lines.CAMERA)
    lines.model_cameras(P, rig)
    ray, middle, passing = np.empty((2, 3)), np.zeros(3), []
    for views in pixels:
        for c in range(2):
            lines.look(rig[c]["back"], views[c, 0], views[c, 1], ray[c])
        found = lines.nearest_places(rig[0]["eye"], ray[0], rig[1]["eye"], ray[1], middle)
        passing.append([*ray.ravel(), *found, *middle])
    eyes = np.column_stack([rig["eye"], rig["eye"], rig["focal"]])
    return {"eyes": eyes, "passing": np.array(passing)}


def assign(cost: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the column that each row is given."""
    column = np.full(len(cost), -1)
    assign_rows(cost, column)
    return column


def rotations(
    angles_rad: NDArray[np.float64], quaternions: NDArray[np.float64], offset: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Return rotations by angles about each axis, and of unit quaternions, and turned offsets."""
    about = {f"about_{axis}": turns.about_axis(axis, angles_rad) for axis in "xyz"}
    turned = np.array([turns.rotate(each, offset) for each in quaternions])
    return {**about, "of_quaternion": turns.matrix(quaternions), "turned": turned}


def look_at(eye: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation of a camera that looks from one place at another."""
    return turns.look_at(eye, target)


class Chain:
    """A robot as numbers: its frames, tool, Jacobian and capsules."""

    def __init__(self, **numbers: Any) -> None:
        """Make a chain of base, joint and tool frames, ranges, speeds, slides and capsules."""
        self._made = chains.SerialChain(
            T_world_from_base=numbers["base"], parent_from_joint=numbers["joints"],
            link_from_tool=numbers["tool"], range_rad=numbers["ranges"],
            velocity_limit_rad_s=numbers["speeds"], slides=numbers["slides"],
            capsule_link=numbers["capsule_link"], capsule_ends=numbers["capsule_ends"],
            capsule_radius_m=numbers["capsule_radius_m"],
        )  # fmt: skip

    def pose(self, q: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return everything that is known at joints q (B, N)."""
        return {
            "frames": chains.link_frames(self._made, q),
            "tool": chains.tool_frame(self._made, q),
            "jacobian": chains.jacobian(self._made, q),
            "turning": chains.angular_jacobian(self._made, q),
            "capsules": chains.capsules(self._made, q),
        }

    def follow(
        self, path: NDArray[np.float64], qd: NDArray[np.float64]
    ) -> dict[str, NDArray[np.float64]]:
        """Return the robot at the end of paths (B, T, N), and its capsules along them."""
        robot, along = chains.robot_path(self._made, path, qd)
        return {
            "q": robot.q, "tool": robot.tool_world, "tool_velocity": robot.tool_velocity_world,
            "axes": robot.tool_axes_world, "capsules": robot.capsules_world, "along": along,
        }  # fmt: skip


def separate(
    a: NDArray[np.float64], radius_a_m: NDArray[np.float64], b: NDArray[np.float64],
    radius_b_m: NDArray[np.float64],
) -> dict[str, NDArray[np.float64]]:  # fmt: skip
    """Return how far apart two sets of capsules are, and where."""
    gap = distances.least_separation(a, radius_a_m, b, radius_b_m)
    return {"gap_m": gap.distance_m, "a": gap.point_a_world, "b": gap.point_b_world}


def closest_on_segments(pairs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return squared distances and places (n, 3) of pairs of segments (n, 4, 3)."""
    return np.array([distances.closest_parameters(*each) for each in pairs])


def enclose_bodies(
    joints_world: NDArray[np.float64], velocity_world: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Return the capsules about moving bodies, and how their ends move."""
    capsules = enclosure.enclose(joints_world)
    moving = enclosure.find_velocities(capsules, joints_world, velocity_world)
    return {"ends": capsules.ends_world, "radius_m": capsules.radius_m, "velocity": moving}


SHAPES = {"plane": shapes.PLANE, "box": shapes.BOX, "cylinder": shapes.CYLINDER,
          "capsule": shapes.CAPSULE}  # fmt: skip
"""Kinds of shapes."""


class Shapes:
    """A table of convex shapes, and capsules of bodies behind them."""

    def __init__(
        self, kinds: list[str], centres: NDArray[np.float64], axes: NDArray[np.float64],
        half_sizes: NDArray[np.float64],
    ) -> None:  # fmt: skip
        """Make a table of n shapes."""
        given = zip(kinds, centres, axes, half_sizes, strict=True)
        self._table = np.stack([shapes.shape(SHAPES[kind], *rest) for kind, *rest in given])

    def bounds(self) -> NDArray[np.float64]:
        """Return the corners of the box round all of them."""
        return shapes.bounds(self._table)

    def passages(
        self, eyes: NDArray[np.float64], directions: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return where lines (m) enter and leave each of the shapes (m, n, 2)."""
        centres = self._table[:, shapes.CENTRE : shapes.AXES]
        return np.array([
            [shapes.passage(self._table, k, eye - centres[k], d) for k in range(len(self._table))]
            for eye, d in zip(eyes, directions, strict=True)
        ])  # fmt: skip

    def hide(
        self, eyes: NDArray[np.float64], points: NDArray[np.float64],
        robot: NDArray[np.float64], radius_m: NDArray[np.float64], n_moving: int,
    ) -> NDArray[np.bool_]:  # fmt: skip
        """Return which points (B, J, 3) are hidden from eyes, the last shapes being moved ones."""
        still, moving = self._table[:-n_moving], self._table[-n_moving:]
        gone = np.stack([shapes.absent_shape()])
        moving = np.repeat(np.concatenate([moving, gone])[None], len(points), 0)
        return sight.find_hidden(sight.Surroundings(still, moving, robot, radius_m), eyes, points)

    def hide_behind_bodies(
        self, eye: NDArray[np.float64], points: NDArray[np.float64],
        bodies: NDArray[np.float64], radius_m: NDArray[np.float64],
    ) -> tuple[NDArray[np.bool_], int]:  # fmt: skip
        """Return which points (J, 3) shapes or bodies' capsules hide, and how many may do so."""
        occluders = sight.make_occluders(self._table, 0, len(bodies))
        shapes.set_capsules(occluders.table, occluders.first_body, bodies, radius_m)
        n = sight.select_occluders(eye, points, occluders)
        hidden = [sight.is_hidden(eye, points, j, occluders, n) for j in range(len(points))]
        return np.array(hidden), int(n)


def floor_ways(
    xs: NDArray[np.float64], ys: NDArray[np.float64], footprints: NDArray[np.float64],
    places: NDArray[np.float64], angles: NDArray[np.float64], goal: tuple[float, float],
) -> dict[str, NDArray[Any]]:  # fmt: skip
    """Return gaps, ways, rays' ranges and values between grid points among footprints."""
    gaps, origin, cell = ways.gaps_m(xs, ys, footprints), np.array([xs[0], ys[0]]), xs[1] - xs[0]
    price = np.where(gaps > 0.05, 1.0 + 0.2 / np.maximum(gaps, 0.05), np.inf)
    at = ways.nearest_point(*goal, origin, cell)
    length = ways.ways_m(price, at, cell)
    return {
        "gaps_m": gaps,
        "ways_m": length,
        "goal": np.array(at),
        "ranges_m": ways.ranges_m(places, angles, gaps, origin, cell, 3.0),
        "between_m": np.array([ways.value_at(x, y, gaps, origin, cell) for x, y in places]),
    }


def meet_footprints(
    capsules: NDArray[np.float64], radius_m: NDArray[np.float64], footprints: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which sets of capsules meet a footprint."""
    return ways.find_overlaps(capsules, radius_m, footprints)


def keep_apart(points: NDArray[np.float64], apart_m: float) -> NDArray[np.int64]:
    """Return which points are kept so that all are so far apart."""
    return ways.select_apart(points, apart_m)


# --- Cameras and the emulator (emulator.py) ------------------------------------------------------

FAULT_KINDS = tuple(faults.KINDS)
EMULATOR_FIELDS = {
    name: name
    for name in (
        "error_scale", "max_error", "swap_share", "miss_share", "min_joints", "outside_confidence",
    )
}  # fmt: skip
LENS_FIELDS = {"exposure_s": "exposure_s", "focal_px": "focal_px", "centre_px": "centre_px"}


def _camera_config(camera: Mapping[str, Any]) -> CameraConfig:
    if "make" in camera:
        return CameraConfig.from_make(
            camera["make"], camera["name"], camera["eye_m"], camera["target_m"]
        )
    plain = {name: value for name, value in camera.items() if name != "lens"}
    lens = Lens(*camera["lens"]) if "lens" in camera else Lens()
    return CameraConfig(**_renamed(plain, {**CAMERA_FIELDS, **LENS_FIELDS}), lens=lens)


class Rig:
    """The cameras of a scene, its own or others, and what stands before them."""

    def __init__(self, place: str, cameras: Any = ()) -> None:
        """Hang cameras (mappings with the names of `CAMERA_FIELDS`, a `lens` or a `make`) into a
        scene; none: its own."""
        config = SceneConfig(cameras=tuple(_camera_config(each) for each in cameras))
        self.scene = build_scene(config, place)
        self.cameras, self.configs = self.scene.cameras, self.scene.rig
        self.home_q = np.asarray(self.scene.home_q)
        self.floor_m = floor_points(self.scene.grounds)

    def describe(self) -> Arrays:
        """Return each camera's projection, eye and size, (C, ...)."""
        return {
            "projection": np.stack([camera.P for camera in self.cameras]),
            "eye_m": np.stack([camera.eye_world for camera in self.cameras]),
            "size_px": np.array([(c.width_px, c.height_px) for c in self.cameras]),
        }

    def surround(self, q: NDArray[np.float64], held: Arrays) -> Any:
        """Return what stands before the cameras: the arm at q (B, N), what people hold (B, W)."""
        at = np.asarray(held["held"], np.int64), np.asarray(held["held_m"], float)
        qpos = np.zeros((len(q), self.scene.model.nq))
        qpos[:, : q.shape[1]] = q
        return self.scene.surroundings(qpos, Held(*at, np.asarray(held["held_turn"], float)))

    def cover_floor(self) -> Arrays:
        """Return pieces of floor (N, 3) and the cameras (N, C) that would detect people there."""
        found = rigs.coverage(self.scene)
        return {"floor_m": found.floor_world, "finds": found.cameras[found.group],
                "piece_m": np.atleast_1d(found.piece_m)}  # fmt: skip

    def see_lines(self, people: Arrays, q: NDArray[np.float64]) -> Arrays:
        """Return how cameras see joints (B, C, W, J) and people (B, C, W, ...), without errors."""
        around = self.surround(q, people)
        sight, look = keypoint_emulator.lines_of_sight(_truth_of(people), around, self.cameras)
        return {"sight": sight, "look": look}


class Crowd:
    """People beyond the slots of workers, as searches of whole images show them."""

    def __init__(self, rig: Rig, n_workers: int) -> None:
        """Begin with nobody."""
        self._known = Bystanders(1, n_workers, rig.cameras)

    def search(
        self, found: Any, taken: Any, hips_m: NDArray[np.float64],
        robot_m: NDArray[np.float64] | None, n_steps: int,
    ) -> dict[str, NDArray[Any]]:  # fmt: skip
        """Return whom is known of, after a search.

        Args:
            found: (C,) windows (x, y, side) [px] of each camera.
            taken: (W, C) those of the workers, None where a camera does not see them.
            hips_m: (W, 3) of the workers; NaN without a track.
            robot_m: (K, 2, 3) capsules.
            n_steps: steps since the last search.
        """
        for _ in range(n_steps):
            self._known.tick(0)
        people = [[_upright(each) for each in windows] for windows in found]
        mine = [[None if each is None else _upright(each) for each in row] for row in taken]
        beside = self._known.update(0, people, mine, hips_m, robot_m)
        now, n = self._known.others(np.arange(1), 0.04), len(self._known.people[0])
        return {
            "hips_m": np.nan_to_num(now.hips_world[0], nan=9.0),
            "age_s": np.minimum(now.age_s[0], 9.0), "remembered": np.array(n),
            "beside": np.array(sum(each.n_cameras for each in beside)),
            "given_up": self._known.given_up[0].copy(),
        }  # fmt: skip


def _upright(place: Sequence[float]) -> Roi:
    x, y, side = place
    return Roi((x, y), side, 0.0)


def _truth_of(people: Arrays) -> WorkerTruth:
    names = ("joints_m", "joint_speed_m_s", "capsules_m", "radius_m")
    return WorkerTruth(*(np.ascontiguousarray(people[name], float) for name in names))


def make_estimate(joints_m: Any, speed_m_s: Any, tracked: Any, cov_m2: Any = None) -> PoseEstimate:
    """Return an estimate of people (B, W, J, 3)."""
    if cov_m2 is None:
        cov_m2 = np.broadcast_to(0.01 * np.eye(3), (*np.shape(joints_m), 3)).copy()
    age_s = np.zeros(np.shape(joints_m)[:-1])
    return PoseEstimate(joints_m, cov_m2, speed_m_s, age_s, tracked)


class Emulator:
    """Keypoints without pixels of people before a rig."""

    def __init__(
        self, rig: Rig, batch: int, n_workers: int, step_s: float, seed: int, **settings: Any
    ) -> None:
        """Draw how the detector errs at first; settings: names of `EMULATOR_FIELDS`."""
        fields = _renamed(settings, EMULATOR_FIELDS)
        self._config = keypoint_emulator.EmulatorConfig(**fields)
        self.rig = rig
        self._rngs = [np.random.default_rng([seed, b]) for b in range(batch)]
        self._state = keypoint_emulator.make_state(
            batch, len(rig.cameras), n_workers, step_s, self._config
        )
        keypoint_emulator.reset(self._state, np.arange(batch), self._rngs)

    def report(
        self, people: Arrays, q: NDArray[np.float64], expected: PoseEstimate | None = None,
        cameras: Any = None, has_no_names: bool = False,
    ) -> Arrays:  # fmt: skip
        """Return the keypoints of one image of each camera, (B, C, W, J, ...)."""
        found = keypoint_emulator.emulate(
            self._state, self._rngs, _truth_of(people), self.rig.surround(q, people),
            cameras or self.rig.cameras, self._config, expected,
        )  # fmt: skip
        if has_no_names:
            found = keypoint_emulator.shuffle_workers(found, self._rngs)
        return _keypoints(found)

    def remember(self) -> Arrays:
        """Return what the errors remember."""
        errors = self._state.errors
        memory = {name: np.array(errors[name]) for name in errors.dtype.names}
        return {**memory, "wander": self._state.wander.copy()}


def _keypoints(found: Keypoints) -> Arrays:
    return {"px": found.px, "confidence": found.confidence, "sigma_px": found.sigma_px}


def fault_table() -> Arrays:
    """Return every fault's usual amount and its bounds."""
    rows = [(kind.usual, *kind.bounds) for kind in faults.KINDS.values()]
    groups = [f"{name} {kind.group}" for name, kind in faults.KINDS.items()]
    return {"amounts": np.array(rows, float), "groups": np.array(groups, "U")}


class Faults:
    """What goes wrong with a rig's cameras over an episode."""

    def __init__(self, rig: Rig, wrong: Any, step_s: float) -> None:
        """Plan faults, mappings with the names of `FAULT_FIELDS`."""
        configs = tuple(faults.FaultConfig(**_renamed(each, FAULT_FIELDS)) for each in wrong)
        self._schedule = fault_schedule.Schedule(rig.configs, configs, step_s)
        self._rig = rig
        self._recent = fault_schedule.History(2, self._schedule)

    def summarise(self) -> NDArray[np.float64]:
        """Return whether nothing is wrong, the longest delay, the memory and what is frozen."""
        plan = self._schedule
        frozen = sum(step + 1 for step in plan.frozen_steps)
        return np.array([plan.is_plain, plan.max_delay_s, plan.longest_memory, frozen], float)

    def list_images(self, seed: int, step: int) -> NDArray[np.float64]:
        """Return of each camera (C, 3): the step that its image shows, when it says it was taken
        (-1: there is none), and how long its shutter was open."""
        plan, rows = self._schedule, []
        for c in range(len(self._rig.cameras)):
            frame = plan.frame(seed, step, c)
            shows = (-1, -1) if frame is None else (frame.scene_step, frame.taken_step)
            rows.append((*shows, plan.exposure_s(c, step)))
        return np.array(rows, float)

    def move_cameras(self, seed: int, step: int) -> Any:
        """Return the cameras as they really are at a step."""
        return self._schedule.actual_cameras(self._rig.cameras, seed, step)

    def begin(self, seed: int) -> NDArray[np.int64]:
        """Begin two episodes and return their numbers for faults."""
        rngs = [np.random.default_rng([seed, b]) for b in range(2)]
        self._recent.reset(np.arange(2), rngs)
        return np.array(self._recent.seeds)

    def arrive(self, b: int) -> NDArray[np.float64]:
        """Take an image of a step and return of each camera (C, 2) the number of the one that
        arrives (-1: none) and its time."""
        step = self._recent.begin_step(b)
        records, times_s = self._recent.exchange(b, step)
        return np.column_stack([[-1 if each is None else each for each in records], times_s])

    def places(self, cameras: Any) -> Arrays:
        """Return places and intrinsics of cameras, (C, ...)."""
        return {
            "place": np.stack([camera.T_world_from_cam for camera in cameras]),
            "intrinsics": np.stack([camera.K for camera in cameras]),
        }


def read_tables() -> Arrays:
    """Return every table of the calibration of keypoints."""
    known = calibration.read_calibration()
    return {name: np.atleast_1d(getattr(known, name)) for name in calibration.SHAPES}


def deviate(
    confidence: NDArray[np.float64], stature_px: Any, posture: Any = None
) -> NDArray[np.float64]:
    """Return deviations that are stated of joints (..., J) with these confidences [px]."""
    if posture is None:
        return noise.sigma_px(confidence, stature_px)
    return noise.sigma_px(confidence, stature_px, posture)


def correct_joints(estimate: PoseEstimate) -> Arrays:
    """Return an estimate of what the network means as one of joints, with deviations [m]."""
    ours = noise.our_joints(estimate)
    factor = np.linalg.cholesky(ours.cov_world)
    return {"joints_m": ours.mean_world, "factor_m": factor, "speed": ours.velocity_world}


def describe_posture(joints_m: NDArray[np.float64], speed_m_s: Any, eye_m: Any) -> Arrays:
    """Return the numbers of a posture (J, 3) on which the errors depend."""
    front = outline.facing(joints_m)
    known = calibration.read_calibration()
    return {
        "facing": np.array(front), "folded": outline.folding(joints_m),
        "kneeling": outline.kneeling(joints_m), "handling": outline.handling(joints_m),
        "speed": outline.speed(speed_m_s), "stepping": outline.stepping(outline.speed(speed_m_s)),
        "shares": np.array(outline.posture_of(joints_m, speed_m_s)),
        "pose": outline.pose_of(joints_m), "novelty_m": outline.novelty_m(joints_m, known.poses),
        "from": outline.view_angle(joints_m, front, eye_m),
        "is_folded": outline.is_folded(joints_m),
    }  # fmt: skip


def believe(rig: Rig, found: Arrays, is_floor_known: bool) -> bool:
    """Return whether keypoints (C, J, ...) are believed to be a person's."""
    floor_m = rig.floor_m if is_floor_known else None
    joints = (found[name] for name in ("px", "confidence", "sigma_px"))
    return plausibility.is_person(*joints, rig.cameras, floor_m)


# --- Recorded motion (importer.py) ---------------------------------------------------------------

ANGLE_ORDERS = ORDERS
"""Orders in which a file may write angles."""
CLIP_COLUMNS = {"controls": "controls", "contacts": "contacts", "size": "size", "fps": "fps"}


def name_joints() -> tuple[str, ...]:
    """Return the fifteen joints' names, in their order."""
    return JOINTS


def joints_of_segments(segments: Arrays, body: str) -> NDArray[np.float64]:
    """Return joints (T, 15, 3) as the network means them, of segments (T, 22, ...)."""
    marks = make_marks(bodies.load_body(body), landmarks=True)
    arm = matrix(segments["turn"])[:, marks.segment] @ marks.offset[..., None]
    return segments["position_m"][:, marks.segment] + arm[..., 0]


def write_capture(
    folder: Path, form: str, segments: Arrays, body: str, fps: float, *, unit_m: float = 1.0,
    is_y_up: bool = False, order: int = 0, has_rest_pose: bool = False, prefix: str = "",
) -> Path:  # fmt: skip
    """Write segments over time as a BVH or an Acclaim file ("bvh", "amc") and return its path."""
    shape, turn = bodies.load_body(body), matrix(segments["turn"])
    if form == "amc":
        return write_acclaim(folder, segments["position_m"], turn, shape)
    return write_bvh(
        folder / "walk.bvh", segments["position_m"], turn, fps, unit_m,
        Y_UP if is_y_up else None, (ORDERS[order], ORDERS[-1 - order]), has_rest_pose,
        lambda segment: cmu_name(segment, prefix), body=shape,
    )  # fmt: skip


def read_recording(
    path: Path, fps: float | None = None, source_fps: float | None = None,
    is_off_floor_allowed: bool = False,
) -> Arrays | None:  # fmt: skip
    """Return joints, rate, what they mean and how much was mended of a file; None: refused."""
    try:
        read = read_capture(path, fps, source_fps, None, is_off_floor_allowed)
    except ConfigError:
        return None
    facts = read.fps, read.are_landmarks, len(read.notes)
    return {
        "joints_m": read.joints_world,
        "facts": np.array([facts], float),
        "names": np.array(read.node_names, "U"),
    }


def make_clip(joints_m: Any, fps: float, are_landmarks: bool, body: str) -> Any:
    """Return a clip for a body of somebody's joints (T, 15, 3), and how far it is from them."""
    capture = Capture(np.asarray(joints_m, float), fps, are_landmarks, JOINTS, "probe")
    return retarget(capture, bodies.load_body(body))


def describe_clip(clip: Any, error: Any) -> Arrays:
    """Return a clip's numbers, and its error's."""
    return {
        "controls": clip.controls,
        "contacts": clip.contacts,
        "size": clip.size,
        "mean_m": error.mean_m,
        "p95_m": error.p95_m,
        "facts": np.array([clip.fps, error.scale, error.slip_m_s]),
    }


def fit_steps(joints_m: Any, fps: float, body: str) -> Arrays:
    """Return what comes of joints (T, 15, 3) step by step: wished, guessed, fitted, with
    feet locked."""
    marks = make_marks(bodies.load_body(body), landmarks=True)
    wished = scale_joints(np.asarray(joints_m, float), fps, marks)
    poses = fit_controls(wished, fps, marks)
    locked, stands = stance.lock_feet(poses, fps, marks.anatomy.lengths)
    return {
        "wished_m": wished, "guess": guess_controls(wished, fps, marks), "poses": poses,
        "locked": locked, "stands": stands,
        "joints_m": locate_joints(locked, marks),
        "slip_m_s": stance.measure_slip(locked, stands, fps, marks.anatomy),
    }  # fmt: skip


def fit_clip(clip: Any, body: str) -> NDArray[np.float64]:
    """Return a clip's controls for a worker of other measures."""
    return scale_clip(clip, measure_anatomy(bodies.load_body(body)).lengths)


def made_clip(values: Arrays, fps: float) -> Any:
    """Return a clip of stored controls, contacts and sizes."""
    stored = (np.asarray(values[name]) for name in ("controls", "contacts", "size"))
    controls, contacts, size = stored
    return Clip(controls.astype(float), fps, contacts.astype(bool), size.astype(float), "probe")


def cut_clips(clips: Any, names: tuple[str, ...], place: str) -> Arrays | None:
    """Return the pieces into which clips are cut for bodies in a place; None: refused."""
    config = motion_config.MotionConfig()
    sizes = np.stack([measure_anatomy(bodies.load_body(name)).lengths for name in names])
    try:
        pieces = cut_into_pieces(
            clips, sizes, make_stage(floorplan.make_floorplan(Floor(place).grounds), config)
        )
    except ConfigError:
        return None
    return {
        "row": pieces.row, "count": pieces.count, "fps": pieces.fps, "frames": pieces.frames,
        "starts": np.concatenate(pieces.starts),
    }  # fmt: skip


def judge_floor(joints_m: NDArray[np.float64], fps: float) -> Arrays:
    """Return where feet rest, the floor's height, and joints on a level floor."""
    height, rests = footing.find_support(joints_m, fps)
    levelled, changes = footing.level_floor(joints_m, fps)
    faults_found = len(footing.describe_floor_faults(joints_m, fps))
    facts = footing.measure_floor_height(joints_m, fps), len(changes), faults_found
    return {"height_m": height, "rests": rests, "level_m": levelled, "facts": np.array(facts)}


def measure_person(joints_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return stature, leg, two bones, and whether the first frame is a rest pose."""
    bones = (
        person.measure_bone(joints_m, a, b) for a, b in (("shoulder", "elbow"), ("knee", "ankle"))
    )
    rest = repair.skip_rest_pose(joints_m)[0]
    return np.array(
        [person.measure_stature(joints_m), person.measure_legs(joints_m), *bones, float(rest)]
    )


def resample(values: NDArray[np.float64], fps: float, wished_fps: float) -> NDArray[np.float64]:
    """Return values (T, ...) at another rate."""
    return person.resample(values, fps, wished_fps)


# --- The detector (detector.py) ------------------------------------------------------------------

Window = tuple[float, float, float, float]
"""Middle x and y, side [px] and turn [rad] of a square of an image."""
Picture = NDArray[np.uint8]
PERSON_FIELDS = ("score", "box", "hip", "rim")
DETECTOR_FIELDS = {
    name: detector.DetectorConfig.RENAMED.get(name, name)
    for name in (
        "min_presence", "sure_presence", "gate_every", "max_offset", "outside_confidence",
        "search_every",
    )
}  # fmt: skip


def _roi(window: Any) -> Roi | None:
    if window is None:
        return None
    x, y, side_px, turn_rad = map(float, window)
    return Roi((x, y), side_px, turn_rad)


def _window(roi: Roi | None) -> Window:
    nothing = (float("nan"),) * 4
    return nothing if roi is None else (*roi.centre_px, roi.side_px, roi.rotation_rad)


def project_joints(rig: Rig, c: int, joints_m: NDArray[np.float64]) -> Any:
    """Return pinhole pixels (J, 2) and depths (J,) of joints before a camera."""
    at = rig.cameras[c].P @ np.column_stack([joints_m, np.ones(len(joints_m))]).T
    return (at[:2] / at[2]).T, at[2]


def window_round(rig: Rig, c: int, joints_px: Any, depth_m: Any) -> Window:
    """Return the window round joints in a camera's image; NaN: there is none."""
    return _window(windows.window_from_joints(joints_px, depth_m, rig.cameras[c]))


def keeps_window(kept: Window, wanted: Window) -> bool:
    """Return whether a window stays though another is wanted."""
    before = _roi(kept)
    return windows.steady_window(before, _roi(wanted)) is before


def window_of_points(hip_px: Any, rim_px: Any) -> Window:
    """Return the window that two points of a body give."""
    return _window(blazepose.window_from_points(hip_px, rim_px))


def place_points(points: NDArray[np.float64], window: Window) -> NDArray[np.float64]:
    """Return where points in shares of a window are in its image [px]."""
    return blazepose.to_image(points, _roi(window))


def search_places(rig: Rig, c: int, is_floor_known: bool) -> NDArray[np.float64]:
    """Return the windows (n, 4) in which a camera's image is searched."""
    found = searching.search_windows(rig.cameras[c], rig.floor_m if is_floor_known else None)
    return np.array([_window(each) for each in found], float).reshape(-1, 4)


def decode_people(boxes: Any, logits: Any, window: Window) -> NDArray[np.float64]:
    """Return score, box, points and window of each person in the detector stage's tensors."""
    found = blazepose.decode_people(boxes, logits)
    rows = [
        np.concatenate([
            *(np.ravel(getattr(each, name)) for name in PERSON_FIELDS),
            _window(blazepose.person_window(each, _roi(window))),
        ])
        for each in found
    ]  # fmt: skip
    return np.array(rows)


def decode_landmarks(points: Any, heat: Any) -> NDArray[np.float64]:
    """Return landmarks (35, 3) of the landmark stage's tensors."""
    return blazepose.decode_landmarks(points, heat)


def agree(rig: Rig, candidates: Any) -> tuple[Any, list[Any]]:
    """Return the windows (C, 4) of each proposal, best first, of candidates (C,) of windows, and
    those that are left without the first one's."""
    known = [[_roi(each) for each in found] for found in candidates]
    proposed = [[_window(w) for w in each] for each in searching.propose_people(known, rig.cameras)]
    first = searching.agreed_windows(known, rig.cameras)
    left = searching.exclude_people(known, [first])
    return np.array(proposed).reshape(-1, len(known), 4), [len(each) for each in left]


def keep_distinct(found: Any, n_cameras: int) -> list[Any]:
    """Return each camera's people of all that were found: camera, score, window."""
    candidates = [searching.Found(c, s, _roi(w)) for c, s, w in found]
    kept = searching.drop_duplicates(candidates, n_cameras)
    return [[_window(each) for each in some] for some in kept]


def to_pinhole(rig: Rig, found: Arrays) -> Arrays:
    """Return keypoints (B, C, W, J) of images with lenses as pinholes would show them."""
    joints = (found[name] for name in ("px", "confidence", "sigma_px"))
    return _keypoints(lenses.pinhole_keypoints(Keypoints(*joints), rig.cameras))


class Drawn:
    """What a probe draws instead of a scene, and remembers how it was posed."""

    def __init__(self, draw: Callable[[Arrays], Picture], size_px: int) -> None:
        """Draw with a function of intrinsics, place and window."""
        self._draw, self.size_px, self.poses = draw, size_px, list[Arrays]()

    def pose(self, q: Any, now: Any) -> None:
        """Remember how the scene is posed."""
        held = (now.held.kind, now.held.position_world, now.held.quaternion_wxyz)
        at = now.position_world, now.quaternion_wxyz
        self.poses.append(dict(enumerate(map(np.array, (q, *at, *held)))))  # type: ignore[arg-type]

    def view(self, camera: Any, window: Any) -> Picture:
        """Draw a window of a pinhole's image."""
        return self._draw({
            "intrinsics": camera.K, "place": camera.T_world_from_cam,
            "window": np.array(_window(window)),
        })  # fmt: skip


def view_through_lens(rig: Rig, drawn: Drawn, c: int, window: Window) -> Picture:
    """Return a window of a camera's image as its lens distorts it."""
    return lenses.LensRenderer(drawn, rig.cameras).crop(c, _roi(window))


def sample_picture(picture: Picture, window: Window, side_px: int) -> Picture:
    """Return an upright picture of a window of an image."""
    return blazepose.crop_window(picture, _roi(window), side_px)


def feed_detector(picture: Picture) -> tuple[NDArray[Any], Window]:
    """Return a picture as the detector stage wants it, and which window it shows."""
    tensor, window = blazepose.detector_input(picture)
    return tensor, _window(window)


def feed_landmarks(picture: Picture) -> NDArray[Any]:
    """Return a picture as the landmark stage wants it."""
    return blazepose.landmark_input(picture)


def spoil_picture(
    rig: Rig, picture: Picture, window: Window, kind: str, amount: float | None,
    seeds: tuple[int, ...],
) -> Picture:  # fmt: skip
    """Return a picture of a window of the first camera with one fault."""
    shown = corruptions.CropView(picture, rig.cameras[0], _roi(window), seeds)
    return corruptions.corrupt(shown, faults.FaultConfig(kind, (0,), amount))


class Film:
    """What cameras with faults and open shutters give of a scene that somebody draws."""

    def __init__(self, rig: Rig, drawn: Drawn, wrong: Any, step_s: float) -> None:
        """Plan faults, mappings with the names of `FAULT_FIELDS`."""
        configs = tuple(faults.FaultConfig(**_renamed(each, FAULT_FIELDS)) for each in wrong)
        plan = fault_schedule.Schedule(rig.configs, configs, step_s)
        self._film = camera_film.CameraFilm(lenses.LensRenderer(drawn, rig.cameras), plan)
        self._rig = rig

    def show(self, step: int, now: Arrays, before: Arrays, shown: Any, seed: int) -> None:
        """Show people and arm now, as they were a step before, to the cameras that are `shown`."""
        at, was = (_posed(each) for each in (now, before))
        pose, last = camera_film.ScenePose(now["q"], at), camera_film.ScenePose(before["q"], was)
        shot = camera_film.Shot(step, pose, last, self._rig.cameras)
        self._film.show([shot if c in shown else None for c in range(len(self._rig.cameras))], seed)

    def take(self, c: int, window: Window) -> Picture:
        """Return a window of a camera's image."""
        return self._film.crop(c, _roi(window))


def _posed(people: Arrays, body: Any = None) -> WorkerMotion:
    held = Held(people["held"], people["held_m"], people["held_turn"])
    still = np.zeros_like(people["position_m"])
    return WorkerMotion(people["position_m"], people["turn"], still, still, held, body)


class Detector:
    """The network in windows of a rig's images that a function gives."""

    def __init__(
        self, rig: Rig, crop: Callable[[int, Window], Picture], is_floor_known: bool = True,
        **settings: Any,
    ) -> None:  # fmt: skip
        """Make a detector; settings: names of `DETECTOR_FIELDS`."""
        config = detector.DetectorConfig(**_renamed(settings, DETECTOR_FIELDS))
        floor_m = rig.floor_m if is_floor_known else None
        self._detector = detector.PoseDetector(rig.cameras, config, floor_m)
        self._crop = crop

    def crop(self, camera_index: int, window: Roi) -> Picture:
        """Give a window of an image, as the detector asks for it."""
        return self._crop(camera_index, _window(window))

    def look(
        self, wanted: Any, track: int = 0, others: Any = (), posture: Any = None, found: Any = None
    ) -> Arrays:
        """Look for somebody through windows (C,), or search."""
        given = {} if posture is None else {"posture": posture}
        seen = self._detector.detect(
            self, [_roi(each) for each in wanted], track, [[_roi(w) for w in o] for o in others],
            None if found is None else [[_roi(w) for w in some] for some in found], **given,
        )  # fmt: skip
        rows = [_window(each) for each in seen.windows]
        return {
            "px": seen.px, "confidence": seen.confidence, "sigma_px": seen.sigma_px,
            "windows": np.array(rows),
        }  # fmt: skip

    def search(self) -> list[Any]:
        """Return the windows of people in whole images, camera by camera."""
        return [[_window(each) for each in some] for some in self._detector.search(self)]

    def forget(self, track: int) -> None:
        """Treat a track as new."""
        self._detector.forget(track)

    def close(self) -> None:
        """Stop threads."""
        self._detector.close()


class Follower:
    """People followed through a rig's images that a function gives, without a simulator."""

    def __init__(
        self, rig: Rig, crop: Callable[[int, Window], Picture], n_workers: int, estimator: str
    ) -> None:
        """Follow at most so many people with an estimator."""
        self._tracker = PoseTracker(rig.cameras, n_workers, estimator=estimator)
        self._crop = crop

    def crop(self, camera_index: int, window: Roi) -> Picture:
        """Give a window of an image, as the detector asks for it."""
        return self._crop(camera_index, _window(window))

    def update(self, dt_s: float | None, seed: int) -> Arrays:
        """Take in the present images and return the belief."""
        belief = self._tracker.update(self, dt_s, [np.random.default_rng(seed)])
        return _as_values(belief)

    def forget(self) -> None:
        """Begin anew with nobody known."""
        self._tracker.forget()

    def close(self) -> None:
        """Stop threads."""
        self._tracker.close()


def joints_by(find: Callable[[Picture], Any], picture: Picture, window: Window) -> Any:
    """Return joints (J, 3) that somebody's own function finds in a picture of a window."""
    return detector.call_detector(find, picture, _roi(window))


class Renderer:
    """The pictures that cameras of a rig would take, drawn."""

    def __init__(self, rig: Rig, n_workers: int, names: tuple[str, ...]) -> None:
        """Make a renderer of the rig's scene with workers."""
        scene = build_scene(rig.scene.config, rig.scene.name, n_workers, names)
        self._renderer = CropRenderer(scene)
        self._lensed = lenses.LensRenderer(self._renderer, scene.cameras)

    def pose(self, people: Arrays) -> None:
        """Pose arm and people, whose bodies are rows of the names."""
        self._renderer.pose(people["q"], _posed(people, people["body"]))

    def draw(self, c: int, window: Window) -> Picture:
        """Return a window of a camera's image."""
        return self._lensed.crop(c, _roi(window))

    def close(self) -> None:
        """Free the graphics context."""
        self._renderer.close()


class Searches:
    """When images are searched, and where cameras look for workers who went astray."""

    def __init__(self, rig: Rig, n_workers: int, every: int) -> None:
        """Begin with one environment before the cameras of a rig."""
        self._schedule = reacquisition.SearchSchedule(1, len(rig.cameras), every)
        self._workers = reacquisition.Reacquisition(1, n_workers, rig.cameras)

    def forget(self, worker: int | None = None) -> None:
        """Begin anew, with one worker or with the searches."""
        if worker is None:
            self._schedule.reset(0)
        else:
            self._workers.reset(0, worker)

    def tick(self, has_image: list[bool]) -> list[int]:
        """Count a step and return the cameras whose images are to be searched."""
        self._schedule.tick(0)
        return self._schedule.due_cameras(0, has_image)

    def remember(self, cameras: list[int], found: list[list[Window]]) -> list[list[Window]]:
        """Keep what some cameras show and return it with what others showed lately."""
        shown = self._schedule.remember(0, cameras, [list(map(_roi, each)) for each in found])
        return [list(map(_window, each)) for each in shown]

    def rest(self) -> None:
        """Leave the cameras that were searched alone for a while."""
        self._schedule.rest(0)

    def count(self, worker: int, shown: NDArray[np.bool_], has_image: list[bool]) -> list[int]:
        """Count the cameras that show a worker and return those to be searched for them."""
        self._workers.count(0, worker, shown)
        return self._workers.blind_cameras(0, worker, has_image)

    def learn(
        self,
        worker: int,
        found: list[list[Window]],
        windows: list[Window],
        others: list[list[Window]],
    ) -> None:
        """Learn what a search for a worker has shown."""
        candidates = [list(map(_roi, each)) for each in found]
        theirs = [list(map(_roi, each)) for each in others]
        self._workers.learn(0, worker, candidates, list(map(_roi, windows)), theirs)

    def look(self, worker: int, expected: list[Window]) -> list[Window]:
        """Return where the cameras look for a worker."""
        return list(
            map(_window, self._workers.choose_windows(0, worker, list(map(_roi, expected))))
        )


# --- Shield and incidents (shield.py) ------------------------------------------------------------

SHIELD_SETTINGS: dict[str, str] = {
    "kind": "kind",
    "margin_m": "margin_m",
    "hand_margin_m": "hand_margin_m",
    "sigmas": "n_sigmas",
    "least_sigmas_m": "min_uncertainty_m",
    "predicted_m_s": "prediction_growth_m_s",
    "doubtful_m": "single_view_std_m",
    "doubtful_sigmas": "single_view_sigmas",
    "human_m_s": "worker_speed_m_s",
    "human_margin_m_s": "worker_speed_margin_m_s",
    "human_s": "worker_time_s",
    "latency_s": "latency_s",
    "reaction_s": "reaction_s",
    "deceleration_m_s2": "deceleration_m_s2",
    "gain_hz": "retreat_gain_hz",
    "retreat_m_s": "max_retreat_m_s",
    "unseen_s": "stale_after_s",
    "unknown_m_s": "unknown_speed_limit_m_s",
    "welcome_m_s": "contact_speed_m_s",
    "still_m_s": "creep_m_s",
}
"""Names of the probes for settings of shields, and today's fields."""
N_SEGMENTS = enclosure.N_CAPSULES
BODY_REGIONS = tuple(contact.REGIONS)
CAPSULE_NAMES = tuple(contact.CAPSULE_REGIONS)
CONTACT_KINDS = incidents.KINDS


def _describe_robot(chain: chains.SerialChain, numbers: Mapping[str, Any]) -> RobotModel:
    """Return a robot whose links share twice its effective mass, and in which a floor is fixed."""
    n, middles = chain.n_joints, np.zeros((chain.n_joints, 3))
    for link, ends in zip(chain.capsule_link, chain.capsule_ends, strict=True):
        middles[link] = ends.mean(0)
    mass_kg = np.full(n, 2.0 * numbers["mass_kg"] / n)
    spread = 0.01 * mass_kg[:, None, None] * np.eye(3)
    inertias = LinkInertias(mass_kg, middles, spread, np.full(n, 0.1))
    floor = shapes.shape(shapes.PLANE, np.zeros(3), np.eye(3), np.array([np.inf, np.inf, 0.0]))
    return RobotModel(chain, numbers["fastest"], numbers["slew"], numbers["mass_kg"],
                      numbers["load_kg"], inertias, floor[None])  # fmt: skip


class Guarded:
    """Robots before people, and what a shield makes of their commands."""

    def __init__(self, chain: Chain, numbers: Mapping[str, Any], now: Mapping[str, Any]) -> None:
        """Describe beliefs of a batch.

        Args:
            chain: the robot.
            numbers: what is known of it for good: `fastest`, `slew`, `mass_kg`, `load_kg`.
            now: `q`, `qd`, `command`, capsules of loads (B, L, 2, 3) and their radii, which are
                `held`, who is `welcome`, and a belief by the names of `Tracker.estimate`.
        """
        made = chain._made
        robot = chains.robot_state(made, now["q"], now["qd"])
        ends = np.concatenate([robot.capsules_world, now["load_capsules"]], 1)
        radius_m = np.concatenate([robot.capsule_radius_m, now["load_radius_m"]])
        robot = dataclasses.replace(robot, capsules_world=ends, capsule_radius_m=radius_m)
        model = _describe_robot(made, numbers)
        n, estimate = len(ends), _as_estimate(now)
        nowhere = np.zeros((*now["held"].shape, 3))
        turn = np.zeros((*now["held"].shape, 4))
        self._now = Belief(
            robot=robot, estimate=estimate, task=None, action=np.zeros((n, 6)),
            separation=estimated_separation(robot, estimate), command=now["command"], model=model,
            objects=ObjectState(nowhere, turn, nowhere, nowhere, now["held"]),
            allowed_contact=now["welcome"],
        )  # fmt: skip
        if "floor_m" in now:
            floor = Coverage(now["floor_m"], now["piece_m"], np.arange(len(now["floor_m"])),
                             np.ones((len(now["floor_m"]), 1), bool))  # fmt: skip
            others = Others(now["others_m"], now["others_age_s"])
            vacancy = Vacancy(floor, now["level"], now["level_age_s"], others)
            unseen = find_unseen_floor(robot, estimate, vacancy)
            self._now = dataclasses.replace(self._now, unseen=unseen)

    def measure_floor(self) -> dict[str, NDArray[np.float64]]:
        """Return how near the floor is on which undetected people may be."""
        unseen = self._now.unseen
        assert unseen is not None, "These beliefs say something of the floor."
        return {"level": unseen.level, "level_age_s": unseen.age_s,
                "possible_m": np.minimum(unseen.possible_m, 9.0),
                "probable_m": np.minimum(unseen.probable_m, 9.0)}  # fmt: skip

    def guard(
        self, wanted: NDArray[np.float64], step_s: float, settings: str | Mapping[str, Any]
    ) -> dict[str, NDArray[Any]]:
        """Return the velocities that a shield allows, and everything that it gives with them."""
        chosen = settings
        if not isinstance(settings, str):
            chosen = {SHIELD_SETTINGS[name]: value for name, value in settings.items()}
        shield = find_shield(chosen)
        assert shield is not None, "These settings are of a shield."
        allowed, given = apply_shield(shield, self._now, wanted, step_s)
        return {"allowed": allowed, **{RENAMED.get(k, k): value for k, value in given.items()}}

    def constrain(
        self, wanted: NDArray[np.float64], step_s: float, settings: Mapping[str, Any]
    ) -> dict[str, NDArray[Any]]:
        """Return the rows that a shield keeps, as sums over them."""
        config = ShieldConfig(**{SHIELD_SETTINGS[name]: each for name, each in settings.items()})
        pose, lost = describe_pose(self._now), find_undetected(self._now, config).is_lost
        found = build_constraints(self._now, pose, lost, wanted, step_s, config)
        is_row = np.arange(found.b.shape[1]) < found.n_rows[:, None]
        J, b = np.where(is_row[..., None], found.J, 0.0), np.where(is_row, found.b, 0.0)
        return {
            "n_rows": found.n_rows, "J": J.sum(1), "b": b.sum(1),
            "Jb": np.einsum("brn,br->bn", J, b), "JJ": (J**2).sum(1), "low": found.low,
            "high": found.high,
            "least_m": np.where(np.isinf(found.clearance_m), 9.0, found.clearance_m),
        }  # fmt: skip

    def measure(self) -> dict[str, NDArray[np.float64]]:
        """Return what a belief says of the distance to people."""
        now = self._now
        far = np.isinf(now.separation.distance_m)
        return {
            "gap_m": np.where(far, 9.0, now.separation.distance_m),
            "std_m": standard_deviation_m(now.estimate),
            "std_towards_m": deviation_towards_robot_m(now.robot, now.estimate),
            "factor_m": covariance_factor_m(now.estimate),
        }  # fmt: skip


def default_shields() -> dict[str, NDArray[Any]]:
    """Return the numbers of the shields that come with the package."""
    fields = [field for field in SHIELD_SETTINGS.values() if field != "kind"]
    return {
        name: np.array([getattr(config, field) for field in fields], float)
        for name, config in PRESETS.items()
    }


def solve_rows(
    J: NDArray[np.float64], b: NDArray[np.float64], weight: NDArray[np.float64],
    low: NDArray[np.float64], high: NDArray[np.float64], wanted: NDArray[np.float64],
) -> NDArray[np.float64]:  # fmt: skip
    """Return the nearest velocities that keep rows as far as their weights ask."""
    x = np.empty_like(wanted)
    problem = solver.Problem(J, b, weight, low, high, wanted)
    solver.solve(problem, x, np.empty((len(x) + 3, len(x))))
    return x


def bear_contact(region: str, speed_m_s: Any, mass_kg: Any) -> NDArray[np.float64]:
    """Return a region's numbers, forces of contacts at speeds, and speeds that it bears."""
    found = contact.REGIONS[region]
    own = [found.transient_n, found.quasi_static_n, found.stiffness_n_m / 1e3, found.mass_kg]
    forces = contact.contact_force(region, speed_m_s, mass_kg)
    speeds = contact.permitted_contact_speed(region, mass_kg)
    return np.array([*own, *np.ravel(forces), *np.ravel(speeds)])


def effective_mass(moving_kg: Any, load_kg: Any) -> NDArray[np.float64]:
    """Return the mass with which a robot hits."""
    return contact.effective_mass(moving_kg, load_kg)


def protective_distance(robot_m_s: Any, human_m_s: Any, **times: Any) -> NDArray[np.float64]:
    """Return how far apart a robot and somebody must be."""
    return separation.protective_distance(robot_m_s, human_m_s, **times)


INCIDENT_FIELDS = {
    "robot_speed_m_s": "came_m_s",
    "closing_speed_m_s": "closing_m_s",
    "is_separation_violated": "too_near",
    "contact_robot_speed_m_s": "contact_came_m_s",
    "contact_closing_speed_m_s": "contact_closing_m_s",
    "separation_violated": "too_near",
}
"""Today's fields of incidents and their summaries that the probes know by another name."""


class Watched:
    """What happens to people, step after step."""

    def __init__(
        self, batch: int, n_workers: int, capsule_names: tuple[str, ...], chain: Chain,
        numbers: Mapping[str, Any], step_s: float,
    ) -> None:  # fmt: skip
        """Begin episodes of a batch."""
        self._make = partial(incidents.IncidentMonitor, batch, n_workers, capsule_names,
                             dt_s=step_s)  # fmt: skip
        self._numbers = numbers
        self._watch: incidents.IncidentMonitor | None = None
        self._chain = chain._made

    def reset(self, places: NDArray[np.int64]) -> None:
        """Begin some episodes anew."""
        if self._watch is not None:
            self._watch.reset(places)

    def step(
        self, robot: NDArray[np.float64], robot_m: NDArray[np.float64],
        workers: NDArray[np.float64], worker_m: NDArray[np.float64], qd: NDArray[np.float64],
        held: NDArray[np.bool_],
    ) -> dict[str, NDArray[Any]]:  # fmt: skip
        """Return what happened while capsules (B, T, K, 2, 3), (B, T, W, L, 2, 3) went so."""
        if self._watch is None:
            n, of = robot.shape[2], self._chain
            few = dataclasses.replace(
                of, capsule_link=of.capsule_link[:n], capsule_ends=of.capsule_ends[:n],
                capsule_radius_m=of.capsule_radius_m[:n],
            )  # fmt: skip
            self._watch = self._make(model=_describe_robot(few, self._numbers), n_robot=n)
        state = chains.robot_state(self._chain, np.zeros_like(qd), qd)
        nowhere, turn = np.zeros((*held.shape, 3)), np.zeros((*held.shape, 4))
        world = World(robot=state, objects=ObjectState(nowhere, turn, nowhere, nowhere, held))
        paths = incidents.measure_paths(robot, robot_m, workers, worker_m)
        found = self._watch.step(world, paths)
        told = incidents.summarize(found, self._watch.history)
        values = {}
        for group, records in (("one", found), ("all", told), ("known", self._watch.history)):
            for name in records.dtype.names:
                named = INCIDENT_FIELDS.get(name, name).removeprefix("is_")
                values[f"{group}/{named}"] = records[name].copy()
        return {**values, "stop_s": self._watch.find_stop_time(state)}


def start_near(home: NDArray[np.float64], spread: NDArray[np.float64], seeds: list[int]) -> Any:
    """Return starts of robots about their home, one for each seed."""
    return starts.draw_near(home, spread, [np.random.default_rng(seed) for seed in seeds])


def start_apart(n: int, seed: int, spread_rad: float, people: str) -> dict[str, NDArray[Any]]:
    """Return where robots begin that people leave room for, and how far apart they then are."""
    simulation = Simulation(n, resolve_settings(perception="none", people=people))
    rngs = [np.random.default_rng([seed, b]) for b in range(n)]
    ids, chain, state = np.arange(n), simulation.chain, simulation.motion
    home = np.tile(np.zeros(chain.n_joints), (1, 1))[0]
    spread = np.full(chain.n_joints, spread_rad)
    q = starts.begin_apart(
        ids, lambda some: starts.draw_near(home, spread, [rngs[b] for b in some]), state, rngs,
        chain, simulation.bodies,
    )  # fmt: skip
    return {"q": q, "gap_m": starts.measure_gap_m(ids, q, state, chain, simulation.bodies)}
