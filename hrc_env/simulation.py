"""The closed loop for a batch of environments: act, move, see, believe, judge.

`HRCEnv` is a simulation of one. A result of environment b depends on its own random
streams only, never on the size of the batch.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from hrc_env import metrics, observations, rewards
from hrc_env.belief import Belief, estimated_separation
from hrc_env.config import Settings
from hrc_env.control import joint_command, n_actions
from hrc_env.core.batching import picked, write_rows
from hrc_env.core.errors import ConfigError, check_shape
from hrc_env.core.kernels import ahead
from hrc_env.core.records import PoseEstimate, RobotState, WorkerMotion, WorkerTruth
from hrc_env.core.stateful import State, Stateful
from hrc_env.core.streams import children
from hrc_env.core.typing import Bools, Floats, Ints, Points3
from hrc_env.geometry import chains
from hrc_env.motion import generator
from hrc_env.pipeline.levels import CAMERA_LEVELS, make_pipeline
from hrc_env.pipeline.sensor_input import SensorInput, TrueSensorInput
from hrc_env.rewards import RewardConfig
from hrc_env.safety.shield import shielded
from hrc_env.scene.build import build
from hrc_env.scene.physics import Physics
from hrc_env.scene.rigs import findings
from hrc_env.step import (
    Info,
    StepResult,
    body_names,
    cost_info,
    miscalibration_info,
    no_cost,
    rows_of,
    tracking_info,
    worker_info,
)
from hrc_env.tasks.task import World
from hrc_env.tracking import oracle
from hrc_env.worker.body import pool, stack, worker_capsules, worker_truth

CLOSING_M_S = 8.0
"""Arm and worker never come nearer to each other than so fast [m/s]; 3.4 was the most in some
290,000 steps of arms that were driven to and fro as hard as they can be."""


@dataclass(slots=True)
class Streams:
    """One random generator per environment for each organ that draws numbers."""

    robot: list[np.random.Generator]
    motion: list[np.random.Generator]
    sensor: list[np.random.Generator]
    tracker: list[np.random.Generator]
    task: list[np.random.Generator]

    def organs(self) -> tuple[list[np.random.Generator], ...]:
        """Them all, in the order in which streams are handed out."""
        return self.robot, self.motion, self.sensor, self.tracker, self.task


N_STREAMS = len(fields(Streams))


class Simulation(Stateful):
    """`batch` environments of the same settings that step together."""

    CHANGES = (
        "physics", "pipeline", "motion", "task_state", "streams", "action", "episode_cost",
        "separation_m", "estimate", "forecast", "body_names", "reward_weights",
    )  # fmt: skip

    def __init__(self, batch: int, settings: Settings) -> None:
        config, perception, scene = settings.config, settings.perception, settings.scene
        ahead.ensure(perception)
        self.batch, self.config, self.control = batch, config, settings.control
        self.shield = settings.shield
        self.perception, self.reward_weights = perception, config.reward
        self.task = settings.task
        self.bodies = stack(pool(config.worker))
        fewest, most = settings.n_workers
        empty = build(config.scene, scene, 0, self.bodies.names, settings.cameras, settings.robot)
        self.motion = generator.make_state(
            batch, most, self.bodies, config.motion, empty.grounds, fewest
        )  # first, as it knows how many workers there is room for
        self.scene = build(
            config.scene, scene, most, self.bodies.names, settings.cameras, settings.robot
        )
        if perception in CAMERA_LEVELS:
            for finding in findings(self.scene):
                warnings.warn(finding, stacklevel=3)
        self.settings = {
            "batch": batch, "task": settings.task.id, "perception": perception,
            "estimator": settings.estimator.name, "scene": scene, "robot": settings.robot.name,
            "cameras": tuple(camera.name for camera in self.scene.cameras),
            "n_workers": (fewest, most) if fewest < most else most, "control": settings.control,
            "config": config,
        }  # fmt: skip
        self.chain = self.scene.chain
        self._spread_rad = np.array(config.start_spread_rad or settings.robot.spread_rad)
        joints = (self.chain.n_joints,)
        check_shape("start_spread_rad", self._spread_rad.shape, joints, "one a joint")
        self.n_actions = n_actions(settings.control, self.chain)
        self.layout = observations.layout(
            self.terms,
            observations.Sizes(
                len(self.scene.home_q), self.n_actions, most, len(config.forecast_s)
            ),
        )
        self.physics = Physics(self.scene, batch)
        self.pipeline = make_pipeline(perception, settings.estimator, self.scene, batch, config)
        self.body_names = np.full(batch, None, object)
        self.task_state = self.task.init(batch)
        self._everyone = np.arange(batch)
        self.action = np.zeros((batch, self.n_actions))
        self.episode_cost = np.zeros(batch)
        self.separation_m = np.zeros(batch)
        self.estimate = oracle.prior(batch, most, config.tracker)
        self.forecast = tuple(oracle.prior(batch, most, config.tracker) for _ in config.forecast_s)
        blank = [np.random.default_rng(0)] * batch
        self.streams = Streams(*(list(blank) for _ in range(5)))

    def reset(self, ids: Ints, rngs: Sequence[np.random.Generator]) -> StepResult:
        """Start environments `ids` anew, one generator each; their rows of an outcome.

        Every organ draws from a stream of its own, always as many and in the same order, so that
        the worker's walk does not depend on who looks at it.
        """
        for b, rng in zip(ids, rngs, strict=True):
            for organ, stream in zip(self.streams.organs(), children(rng, N_STREAMS), strict=True):
                organ[b] = stream
        generator.reset(self.motion, ids, self.streams.motion)
        self.body_names[ids] = body_names(
            self.motion.body[ids], self.motion.present[ids] > 0.0, self.bodies.names
        )
        self.physics.reset(ids, self._starting_angles(ids), self.motion.body[ids])
        self.action[ids], self.episode_cost[ids], self.separation_m[ids] = 0.0, 0.0, 0.0
        robot = chains.robot_state(self.chain, self.physics.q[ids], self.physics.qd[ids])
        self.task.reset(self.task_state, ids, self.streams.task, World(robot), self.config.task)
        self.pipeline.reset(ids, self.streams.sensor, self.streams.tracker)
        motion = generator.current(self.motion, ids)
        truth = worker_truth(self.bodies, motion)
        estimate, forecast = self._perceive(ids, motion, truth)
        believed = self._believed(ids, robot, estimate, forecast)
        observation = observations.observe(believed, self.layout, self.terms)
        info = {
            **no_cost(len(ids)),
            **tracking_info(estimate, truth, self.present[ids]),
            **self._episode_info(ids),
        }
        return StepResult(observation, np.zeros(len(ids)), np.zeros(len(ids), bool), info)

    def step(self, action: Floats) -> StepResult:
        """One control step of every environment; action (B, A) in [-1, 1]."""
        config, streams = self.config, self.streams
        previous, self.action = self.action, np.array(action, float)
        command = joint_command(
            self.control, action, self.physics.q, self.chain, self.scene.home_q, config.control
        )
        shield_info: Info = {}
        if self.shield is not None:
            command, shield_info = shielded(self.shield, self.believed, command, config.ctrl_dt)
        path, motion = generator.advance(
            self.motion, streams.motion, config.scene.sim_dt, config.n_substeps
        )
        apart = self.separation_m > CLOSING_M_S * config.ctrl_dt
        q_path = self.physics.step(command, path, apart)
        truth = worker_truth(self.bodies, motion)

        estimate, forecast = self._perceive(self._everyone, motion, truth)
        robot, arm = chains.robot_along(self.chain, q_path, self.physics.qd)
        seen_world = robot.capsules_world[:, self.scene.watched, 1]
        generator.watch(self.motion, seen_world, motion, config.ctrl_dt)
        progress = self.task.advance(
            self.task_state, streams.task, World(robot), config.ctrl_dt, config.task
        )
        believed = self._believed(self._everyone, robot, estimate, forecast)
        terms = {
            **rewards.evaluated(self.task.rewards, believed, progress, previous, config.task),
            **rewards.evaluated(
                rewards.SHARED_TERMS, believed, progress, previous, self.reward_weights
            ),
        }
        reward = rewards.total(terms, self.batch)

        workers = worker_capsules(self.bodies, path, motion.body)
        cost = metrics.cost(
            arm, robot.capsule_radius_m, workers, truth.capsule_radius_m, config.cost
        )
        self.episode_cost += cost.total
        self.separation_m = cost.min_separation_m
        present = self.present
        info = {
            **{f"reward/{name}": value for name, value in terms.items()},
            **cost_info(cost, present),
            **tracking_info(estimate, truth, present),
            **shield_info,
            **self._episode_info(self._everyone),
        }
        terminated = (cost.contact > 0) & config.cost.contact_terminates
        observation = observations.observe(believed, self.layout, self.terms)
        return StepResult(observation, reward, terminated, info)

    def set_reward(self, weights: RewardConfig) -> None:
        """Weigh the reward's terms so from the next step on."""
        self.reward_weights = weights

    def get_state(self) -> State:
        """A copy of everything that changes, generators included, and the settings."""
        return {"settings": self.settings, **super().get_state()}

    def set_state(self, state: State) -> None:
        """Continue from a state, bit for bit.

        Raises:
            ConfigError: it was taken with other settings.
        """
        for name, value in self.settings.items():
            if state["settings"][name] != value:
                raise ConfigError(
                    f"The state was taken with {name}={state['settings'][name]!r}; "
                    f"here {name} is {value!r}. Make the environment with the same arguments."
                )
        super().set_state(state)

    def close(self) -> None:
        """Release threads and graphics contexts."""
        self.pipeline.close()

    def _starting_angles(self, ids: Ints) -> Floats:
        """(len(ids), N) arm angles near home, turned anywhere in front of the base."""
        spread = self._spread_rad
        angles = [
            self.scene.home_q + self.streams.robot[b].uniform(-1, 1, len(spread)) * spread
            for b in ids
        ]
        return np.array(angles).reshape(len(ids), -1)

    @property
    def terms(self) -> tuple[observations.ObservationTerm, ...]:
        """Of the observation, in their order."""
        return self.task.observation_terms

    @property
    def present(self) -> Bools:
        """(B, W) who is in the episode."""
        return generator.activity(self.motion) != generator.ABSENT

    @property
    def believed(self) -> Belief:
        """What every robot believes now."""
        robot = chains.robot_state(self.chain, self.physics.q, self.physics.qd)
        return self._believed(self._everyone, robot, self.estimate, self.forecast)

    def markers(self, b: int) -> Points3:
        """(M, 3) what the task of environment `b` has to show [m]."""
        view = self.task.view(self.task_state, np.array([b]), self.config.task)
        return self.task.markers(view)[0]

    def _perceive(
        self, ids: Ints, motion: WorkerMotion, truth: WorkerTruth
    ) -> tuple[PoseEstimate, tuple[PoseEstimate, ...]]:
        """Let the pipeline look at environments `ids`: their estimates now and ahead."""
        now = SensorInput(ids, self.physics.q[ids], motion)
        if self.pipeline.NEEDS_TRUTH:
            present = self.motion.present[ids] > 0.0
            now = TrueSensorInput(ids, now.q, motion, truth, present)
        streams = self.streams
        estimate = self.pipeline.perceive(
            now, picked(streams.sensor, ids), picked(streams.tracker, ids)
        )
        forecast = tuple(
            self.pipeline.forecast(estimate, ids, horizon_s) for horizon_s in self.config.forecast_s
        )
        if ids is self._everyone:
            self.estimate, self.forecast = estimate, forecast
        else:
            for whole, part in zip(
                (self.estimate, *self.forecast), (estimate, *forecast), strict=True
            ):
                write_rows(whole, ids, part)
        return estimate, forecast

    def _believed(
        self,
        ids: Ints,
        robot: RobotState,
        estimate: PoseEstimate,
        forecast: tuple[PoseEstimate, ...],
    ) -> Belief:
        """What the robots of environments `ids` believe; the records are of them only."""
        return Belief(
            robot=robot,
            estimate=estimate,
            separation=estimated_separation(robot, estimate),
            task=self.task.view(self.task_state, ids, self.config.task),
            action=self.action[ids],
            forecast=forecast,
        )

    def _episode_info(self, ids: Ints) -> Info:
        """What the episodes of environments `ids` have come to so far, and who is there."""
        tally = {"episode_cost": self.episode_cost, **self.task.info(self.task_state)}
        return {
            **rows_of(tally, ids),
            **worker_info(generator.activity(self.motion)[ids], self.body_names[ids]),
            **miscalibration_info(self.settings["cameras"], self.pipeline.suspected(ids)),
        }


def checked_action(action: ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Actions as float64 of a shape, clipped to [-1, 1].

    Raises:
        ConfigError: another shape, or values that are no finite numbers.
    """
    try:
        values = np.asarray(action, np.float64)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"action must be numbers of shape {shape}, got {action!r}.") from error
    check_shape("action", values.shape, shape, "(environments,) joint or tool velocities")
    if not np.isfinite(values).all():
        raise ConfigError(f"action must be finite numbers in [-1, 1], got {values}.")
    return np.minimum(np.maximum(values, -1.0), 1.0)
