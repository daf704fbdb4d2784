"""The closed loop for a batch of environments: act, move, see, believe, judge.

`HRCEnv` is a simulation of one. A result of environment b depends on its own random
streams only, never on the size of the batch.
"""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from hrc_env import metrics, observations, rewards, room, step
from hrc_env.belief import Belief, estimated_separation, of_concern, unseen_floor
from hrc_env.config import Settings
from hrc_env.control import joint_command, n_actions
from hrc_env.core.batching import State, Stateful, picked, rows, write_rows
from hrc_env.core.errors import ConfigError, check_shape
from hrc_env.core.infos import Info
from hrc_env.core.records import PoseEstimate, WorkerMotion, WorkerTruth, World
from hrc_env.core.streams import children
from hrc_env.core.typing import Bools, Floats, Ints, JointVelocities, Points3, Records
from hrc_env.geometry import chains
from hrc_env.motion import generator, starts
from hrc_env.motion.activities.pieces import NoRoomError
from hrc_env.pipeline.levels import CAMERA_LEVELS, make_pipeline, prepare
from hrc_env.pipeline.sensor_input import SensorInput, TrueSensorInput
from hrc_env.rewards import RewardConfig
from hrc_env.safety import incidents
from hrc_env.safety.model import robot_model
from hrc_env.safety.shield import shielded
from hrc_env.safety.watch import Watch
from hrc_env.scene import handling
from hrc_env.scene.build import build
from hrc_env.scene.physics import Physics
from hrc_env.scene.rigs import findings
from hrc_env.step import Observation, StepResult
from hrc_env.tasks import goal
from hrc_env.tracking import oracle
from hrc_env.worker.body import pool, stack, worker_capsules, worker_truth

CLOSING_M_S = 8.0
"""Arm and worker never come nearer to each other than so fast [m/s]; 3.4 was the most in some
290,000 steps of arms that were driven to and fro as hard as they can be."""
STREAMS = ("robot", "motion", "sensor", "tracker", "task")
"""Who draws numbers, each from a generator of its own, in the order in which these are handed out:
the worker's walk does not depend on who looks at it."""
MEASURING = "objects"
"""And who measures loose objects, where there are any: from a child of the task's."""


class Simulation(Stateful):
    """`batch` environments of the same settings that step together."""

    CHANGES = (
        "physics", "pipeline", "motion", "task_state", "streams", "action", "episode_cost", "watch",
        "separation_m", "estimates", "reward_weights", "identities", "measured", "shield_change",
    )  # fmt: skip

    def __init__(self, batch: int, settings: Settings) -> None:
        config, perception = settings.config, settings.perception
        prepare(perception, config.detector)
        self.batch, self.config, self.control = batch, config, settings.control
        self.perception, self.shield, self.task = perception, settings.shield, settings.task
        self.bodies = stack(pool(config.worker))
        fewest, most = settings.n_workers
        scene_for = partial(
            build, config.scene, settings.scene,
            bodies=self.bodies.names, cameras=settings.cameras, robot=settings.robot,
            things=self.task.make_things(),
        )  # fmt: skip
        try:  # first, as it knows how many workers and which clips there is room for
            self.motion = generator.make_state(
                batch, most, self.bodies, config.motion, scene_for(n_workers=0).grounds, fewest,
                settings.robot.girth_m,
            )  # fmt: skip
        except NoRoomError as error:
            where = room.told(error.clip, room.played_s(error.clip, config))
            raise ConfigError(f"{error} {where}") from None
        self.scene = scene_for(n_workers=most)
        if perception in CAMERA_LEVELS:
            for finding in findings(self.scene):
                warnings.warn(finding, stacklevel=3)
        self.settings = settings.recorded(batch, self.scene)
        self.chain, n_joints = self.scene.chain, self.scene.chain.n_joints
        room.check_reach(self.task, self.scene)
        self._spread_rad = np.array(config.start_spread_rad or settings.robot.spread_rad)
        check_shape("start_spread_rad", self._spread_rad.shape, (n_joints,), "one a joint")
        self._grips = settings.robot.grips
        self.n_actions = n_actions(settings.control, self.chain, self._grips)
        n_slides = int(self.chain.slides.sum())
        self.place = self.task.survey(self.scene.map)
        sizes = observations.Sizes(
            n_joints - n_slides, self.n_actions, most, len(config.forecast_s), config.uncertainty,
            int(self._grips), int(settings.robot.hand is not None), len(self.scene.objects.names),
            n_slides,
        )  # fmt: skip
        self.layout = observations.layout(self.terms, sizes)
        self.model = robot_model(self.scene, settings.control, config.control)
        self.watch = Watch(batch, most, self.bodies.capsule_names, self.model, config.ctrl_dt)
        self.physics = Physics(self.scene, batch)
        self.pipeline = make_pipeline(perception, settings.estimator, self.scene, batch, config)
        self.task_state = self.task.make_state(batch)
        self._everyone, self.reward_weights = np.arange(batch), config.reward
        self.action, self.shield_change = (np.zeros((batch, n)) for n in (self.n_actions, n_joints))
        self.episode_cost, self.separation_m = np.zeros(batch), np.zeros(batch)
        made = (batch, most, config.tracker)
        self.estimates = tuple(oracle.prior(*made) for _ in (0.0, *config.forecast_s))
        """What is believed of the workers now, and expected at each of `forecast_s`."""
        self.identities, self.keys = metrics.no_identities(batch, most), list[str]()
        robot = chains.robot_state(self.chain, self.physics.q, self.physics.qd)
        self.measured = handling.world_of(self.physics, self._everyone, robot).objects
        """The task's loose objects as they were measured last; None: there are none."""
        self.streams = {name: [np.random.default_rng(0)] * batch for name in (*STREAMS, MEASURING)}

    def reset(self, ids: Ints, rngs: Sequence[np.random.Generator]) -> StepResult:
        """Start environments `ids` anew, one generator each; their rows of a result."""
        streams = self.streams
        for b, rng in zip(ids, rngs, strict=True):
            for name, stream in zip(STREAMS, children(rng, len(STREAMS)), strict=True):
                streams[name][b] = stream
            if self.measured is not None:
                streams[MEASURING][b] = streams["task"][b].spawn(1)[0]
        self.action[ids], self.episode_cost[ids], self.separation_m[ids] = 0.0, 0.0, 0.0
        self.shield_change[ids] = 0.0
        self.watch.reset(ids)
        task, people = self.task, (self.motion, streams["motion"])
        q = starts.apart(ids, self._starting_angles, *people, self.chain, self.bodies)
        robot = chains.robot_state(self.chain, q, np.zeros_like(q))
        task.reset(self.task_state, ids, streams["task"], World(robot, place=self.place))
        poses = task.object_poses(self.task_state, ids)
        self.physics.reset(ids, q, self.motion.workers["body"][ids], poses)
        world = handling.world_of(self.physics, ids, robot)
        self._measure(ids, world)
        self.pipeline.reset(ids, streams["sensor"], streams["tracker"])
        truth = worker_truth(self.bodies, motion := generator.current(self.motion, ids))
        self._expose(ids, motion, truth)
        belief = self._believed(ids, world, estimates := self._perceive(ids))
        identities = metrics.no_identities(*self.present[ids].shape)
        present, terms = self.present[ids], (*task.own_rewards, *rewards.SHARED_TERMS)
        info = step.agreed(self.keys, {
            **step.reset_info(robot, truth, present, terms, self.config.cost),
            **step.tracking_info(estimates[0], truth, present, identities),
            **shielded(self.shield, belief, np.zeros_like(q), self.config.ctrl_dt)[1],
            **self._episode_info(ids, generator.activity(self.motion), None),
        })  # fmt: skip
        write_rows(self.identities, ids, identities)
        return StepResult(self._observed(belief), nothing := np.zeros(len(ids)), nothing > 0, info)

    def step(self, action: Floats) -> StepResult:
        """One control step of every environment; action (B, A) in [-1, 1]."""
        config = self.config
        previous, self.action = self.action, np.array(action, float)
        command, shield_info = self._command()
        path, motion = generator.advance(
            self.motion, self.streams["motion"], config.scene.sim_dt, config.n_substeps
        )
        far = self.separation_m > CLOSING_M_S * config.ctrl_dt
        self.physics.apply(self.task.effects(self.task_state))
        grip = self.action[:, -1] if self._grips else None
        q_path = self.physics.step(command, path, far, grip)
        truth = worker_truth(self.bodies, motion)
        self._expose(self._everyone, motion, truth)
        estimates = self._perceive(self._everyone)
        n = self.chain.n_joints
        robot, arm = chains.robot_along(self.chain, q_path[..., :n], self.physics.qd)
        world = handling.world_of(self.physics, self._everyone, robot)
        world, arm = handling.loaded(self.scene, world, arm, q_path, self._loads)
        self._measure(self._everyone, world)
        robot = world.robot
        seen_world = robot.capsules_world[:, self.scene.watched, 1]
        cue = self.task.signal(self.task_state)
        generator.watch(self.motion, seen_world, motion, config.ctrl_dt, cue)
        if cue is not None:
            world = replace(world, deeds=generator.deeds(self.motion, motion))
        workers = worker_capsules(self.bodies, path, motion.body)
        paths = incidents.measured(arm, robot.capsule_radius_m, workers, truth.capsule_radius_m)
        cost, happened = metrics.cost(paths.gaps_m, config.cost), self.watch.step(world, paths)
        judged = replace(world, touched=cost.contact > 0, place=self.place)
        progress = self.task.advance(self.task_state, self.streams["task"], judged, config.ctrl_dt)
        belief = self._believed(self._everyone, world, estimates)
        terms = self._reward_terms(belief, progress, previous)
        activity = generator.activity(self.motion)
        present = activity != generator.ABSENT
        costs = step.cost_info(cost, happened, present, config.cost)
        self.episode_cost += costs["cost"]
        self.separation_m = cost.min_separation_m
        info = step.agreed(self.keys, {
            **{f"reward/{name}": value for name, value in terms.items()},
            **costs,
            **step.incident_info(happened, self.watch, robot),
            **step.tracking_info(estimates[0], truth, present, self.identities),
            **shield_info,
            **self._episode_info(self._everyone, activity, happened),
        })  # fmt: skip
        over = (cost.contact > 0) & config.cost.contact_terminates
        over |= self.task.is_terminal(progress)
        return StepResult(self._observed(belief), rewards.total(terms, self.batch), over, info)

    def set_reward(self, weights: RewardConfig) -> None:
        """Weigh the reward's terms so from the next step on."""
        self.reward_weights = weights

    def get_state(self) -> State:
        """A copy of everything that changes, generators included, and the settings."""
        return {"settings": self.settings, **super().get_state()}

    def set_state(self, state: State) -> None:
        """Continue from a state that was taken with the same settings, bit for bit."""
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

    @property
    def estimate(self) -> PoseEstimate:
        """What is believed of the workers now."""
        return self.estimates[0]

    @property
    def terms(self) -> tuple[observations.ObservationTerm, ...]:
        """Of the observation, in their order."""
        more = observations.SHIELD_TERMS if self.config.observe_shield else ()
        return (*self.task.observation_terms, *more)

    @property
    def present(self) -> Bools:
        """(B, W) who is in the episode."""
        return generator.activity(self.motion) != generator.ABSENT

    @property
    def belief(self) -> Belief:
        """What every robot believes now."""
        robot = chains.robot_state(self.chain, self.physics.q, self.physics.qd)
        world, arm = handling.world_of(self.physics, self._everyone, robot), robot.capsules_world
        qpos = self.physics.qpos[:, None]
        world, _ = handling.loaded(self.scene, world, arm[:, None], qpos, self._loads)
        return self._believed(self._everyone, world, self.estimates)

    def markers(self, b: int) -> Points3:
        """(M, 3) what the task of environment `b` has to show [m]."""
        view = self.task.view(self.task_state, np.array([b]))
        return self.task.markers(view)[0]

    @property
    def _loads(self) -> Bools | bool:
        return self.task.is_load(self.task_state)

    def _starting_angles(self, ids: Ints) -> Floats:
        """Draw the angles (len(ids), N) with which robots start."""
        rngs = picked(self.streams["robot"], ids)
        return self.task.draw_start(rngs, self.place, self.scene.home_q, self._spread_rad)

    def _command(self) -> tuple[JointVelocities, Info]:
        """(B, N) what the arms are to do [rad/s], and what the shield says to it."""
        command = joint_command(
            self.control, self.action[:, : self.n_actions - self._grips], self.physics.q,
            self.chain, self.scene.home_q, self.config.control,
        )  # fmt: skip
        if self.shield is None:
            return command, {}
        allowed, said = shielded(self.shield, self.belief, command, self.config.ctrl_dt)
        self.shield_change = allowed - command
        return allowed, said

    def _expose(self, ids: Ints, motion: WorkerMotion, truth: WorkerTruth) -> None:
        """Show environments `ids` to the sensor, which alone sees them."""
        now = SensorInput(ids, self.physics.qpos[ids], motion)
        if self.pipeline.sensor.NEEDS_TRUTH:
            now = TrueSensorInput(ids, now.qpos, motion, truth, self.motion.workers["present"][ids])
        self.pipeline.sensor.expose(now)

    def _perceive(self, ids: Ints) -> tuple[PoseEstimate, ...]:
        """Let the pipeline perceive what was shown of environments `ids`: their `estimates`."""
        sensor, tracker = (picked(self.streams[name], ids) for name in ("sensor", "tracker"))
        estimate = self.pipeline.perceive(ids, sensor, tracker)
        later = (self.pipeline.forecast(estimate, ids, t) for t in self.config.forecast_s)
        estimates = (estimate, *later)
        if ids is self._everyone:
            self.estimates = estimates
        else:
            for whole, part in zip(self.estimates, estimates, strict=True):
                write_rows(whole, ids, part)
        return estimates

    def _measure(self, ids: Ints, world: World) -> None:
        """Measure the loose objects of environments `ids`."""
        if world.objects is not None:
            rngs = picked(self.streams["objects"], ids)
            write_rows(
                self.measured, ids, handling.measured(world.objects, rngs, self.config.objects)
            )

    def _believed(self, ids: Ints, world: World, estimates: tuple[PoseEstimate, ...]) -> Belief:
        """What the robots of environments `ids` believe; the records are of them only."""
        unseen = unseen_floor(world.robot, estimates[0], self.pipeline.vacancy(ids))
        belief = Belief(
            robot=world.robot,
            estimate=of_concern(estimates[0], unseen),
            separation=estimated_separation(world.robot, estimates[0]),
            hand=world.hand,
            objects=None if self.measured is None else rows(self.measured, ids),
            task=self.task.view(self.task_state, ids),
            action=self.action[ids],
            forecast=estimates[1:],
            command=self.physics.command[ids],
            shield_change=self.shield_change[ids],
            model=self.model,
            unseen=unseen,
        )
        return replace(belief, allowed_contact=self.task.allowed_contact(belief))

    def _observed(self, belief: Belief) -> Observation:
        """What robots see, and their goals if the task sets them apart."""
        flat, apart = observations.observe(belief, self.layout, self.terms), self.task.goal
        return flat if apart is None else {**goal.parts(apart, belief), observations.FLAT: flat}

    def _reward_terms(self, belief: Belief, progress: Any, previous: Floats) -> dict[str, Floats]:
        """(B,) every term of the reward: the task's, then what all tasks share."""
        own, shared = self.task.own_rewards, rewards.SHARED_TERMS
        return {
            **rewards.evaluated(own, belief, progress, previous, self.config.task),
            **rewards.evaluated(shared, belief, progress, previous, self.reward_weights),
        }

    def _episode_info(self, ids: Ints, activity: Ints, happened: Records | None) -> Info:
        """What the episodes of environments `ids` have come to so far, and who is there."""
        tally = {"episode_cost": self.episode_cost, **self.task.info(self.task_state)}
        body, cameras, seen = self.motion.workers["body"], self.settings["cameras"], self.pipeline
        return {
            **{name: value[ids] for name, value in tally.items()},
            **step.worker_info(activity[ids], body[ids], happened),
            **step.perception_info(cameras, seen.suspected(ids), seen.vacancy(ids)),
        }
