"""Closed loop of a batch of environments: control, motion, perception and evaluation.

`HRCEnv` is a simulation with a batch of one. The results of environment b depend only on the random
streams of that environment, never on the size of the batch.
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from hrc_env import infos, observations, rewards
from hrc_env.belief import Belief, drop_distant_unknown, estimated_separation, find_unseen_floor
from hrc_env.control import joint_command, max_command, n_actions
from hrc_env.core.batching import State, Stateful, change_fields, rows, select_streams, write_rows
from hrc_env.core.declared import Records2
from hrc_env.core.errors import ConfigError, check_shape, require
from hrc_env.core.infos import Info
from hrc_env.core.records import PoseEstimate, WorkerMotion, WorkerTruth
from hrc_env.core.streams import children, restart
from hrc_env.core.typing import Bools, Floats, Ints, JointAngles, JointVelocities, Points3
from hrc_env.episode_cameras import NOTHING_GIVEN, EpisodeCameras
from hrc_env.geometry import chains
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.geometry.reach import check_reach
from hrc_env.motion import fit, generator, starts
from hrc_env.motion.activities.pieces import NoRoomError
from hrc_env.pipeline.levels import CAMERA_LEVELS, prepare
from hrc_env.pipeline.observed_images import Images, ObservedImages
from hrc_env.pipeline.sensor_input import SensorInput, TrueSensorInput
from hrc_env.pipeline.tracking import PerceptionPipeline
from hrc_env.reset_options import Fixed, Options, Room, fix
from hrc_env.rewards import RewardConfig
from hrc_env.safety import incidents
from hrc_env.safety.cost import measure_cost
from hrc_env.safety.incidents import Incident, IncidentMonitor, Paths
from hrc_env.safety.shield import apply_shield
from hrc_env.scene import handling
from hrc_env.scene.build import Scene, all_grounds, build
from hrc_env.scene.domain_randomization import Look
from hrc_env.scene.limits import object_targets, robot_model
from hrc_env.scene.physics import Physics
from hrc_env.scene.rigs import describe_defects
from hrc_env.settings import Settings
from hrc_env.step_result import Observation, StepResult, check_keys
from hrc_env.tasks import goal
from hrc_env.tracking import metrics, oracle
from hrc_env.worker.body import load_bodies, select_bodies, worker_capsules, worker_truth
from hrc_env.world import WorkerProgress, World

CLOSING_M_S = 8.0
"""Upper bound on the speed at which robot and worker approach each other [m/s]. The maximum in
about 290,000 steps of robots that moved back and forth at their limits was 3.4."""
STREAMS = ("robot", "motion", "sensor", "tracker", "task")
"""Random streams of an environment, in the order in which their generators are spawned. Separate
streams make the workers' motion independent of the perception."""
MEASURING = "objects"
"""Random stream for measurements of loose objects, spawned from that of the task."""


@dataclass(frozen=True, slots=True, eq=False)
class Command:
    """Commands of the robots in a step."""

    velocities: JointVelocities
    """(B, N) joint velocities that the shield allows [rad/s], or [m/s] for slides."""
    previous_action: Floats
    """(B, A) actions of the previous step."""
    shield_info: Info
    """Infos of the shield; empty without a shield."""


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """True state of the world for sensors, task, cost and metrics, which beliefs never contain."""

    ids: Ints
    """(B,) index of the environment of each row."""
    world: World
    """State of the robots, including their loads, and of the objects."""
    motion: WorkerMotion
    """Poses and velocities of the workers' bodies."""
    workers: WorkerTruth
    """Joints and capsules of the workers."""
    paths: Paths | None = None
    """Paths of robots and workers during a step; None at the start of an episode."""
    task_step: Any = None
    """Result of the task's step, as returned by `Task.advance`."""


class Simulation(Stateful):
    """A batch of environments with the same settings that step together.

    Args:
        batch: number B of environments.
        settings: settings that the environments share.
    """

    CHANGES = (
        "physics",
        "cameras",
        "motion",
        "task_state",
        "streams",
        "action",
        "episode_cost",
        "monitor",
        "separation_m",
        "estimates",
        "reward_weights",
        "identities",
        "measured",
        "shield_change",
    )

    def __init__(self, batch: int, settings: Settings) -> None:
        config, perception = settings.config, settings.asked.perception
        prepare(perception, config.detector)
        self.batch, self.config, self.control = batch, config, settings.asked.control
        self.perception, self.shield, self.task = perception, settings.shield, settings.task
        self._wants_pairs = settings.estimator.wants_pairs
        self.bodies = load_bodies(select_bodies(config.worker))
        self._make_people_and_scene(settings)
        if perception in CAMERA_LEVELS:
            n, rigs = len(self.scene.cameras), settings.rigs
            fewest = n if rigs is None else rigs.counts(n).fewest
            for defect in describe_defects(self.scene, self._wants_pairs, fewest):
                warnings.warn(defect, stacklevel=3)
        self.settings = settings.describe(batch, self.scene)
        self.chain, n_joints = self.scene.chain, self.scene.chain.n_joints
        targets = [*self.task.reach_targets(), *object_targets(self.scene)]
        check_reach(self.task.id, self.scene.robot.name, self.chain, targets)
        self._spread_rad = np.array(config.start_spread_rad or settings.robot.spread_rad)
        check_shape("start_spread_rad", self._spread_rad.shape, (n_joints,), "one entry per joint")
        self._grips = settings.robot.grips
        self.n_actions = n_actions(self.control, self.chain, self._grips)
        n_slides = int(self.chain.slides.sum())
        self.place = self.task.survey(self.scene.map)
        sizes = observations.Sizes(
            n_joints - n_slides,
            self.n_actions,
            self.scene.n_workers,
            len(config.forecast_s),
            config.uncertainty,
            int(self._grips),
            int(settings.robot.hand is not None),
            len(self.scene.objects.names),
            n_slides,
        )
        self.layout = observations.make_layout(self.terms, sizes)
        self.model = robot_model(self.scene, max_command(self.control, self.chain, config.control))
        n_capsules = len(self.chain.capsule_radius_m) + self.scene.objects.capsule_radius_m.size
        self.monitor = IncidentMonitor(
            batch, self.scene.n_workers, self.bodies.capsule_names, n_capsules, self.model,
            config.ctrl_dt,
        )  # fmt: skip
        self.physics = Physics(self.scene, batch)
        self.cameras = EpisodeCameras(batch, settings, self.scene)
        """Cameras and perception pipelines of the environments."""
        self.task_state = self.task.make_state(batch)
        self._everyone, self.reward_weights = np.arange(batch), config.reward
        self.reward_factors: dict[str, float] = {}
        """Factors by which reward terms are multiplied, by name; all other terms have the factor
        1."""
        self.action, self.shield_change = (np.zeros((batch, n)) for n in (self.n_actions, n_joints))
        self.episode_cost, self.separation_m = np.zeros(batch), np.zeros(batch)
        made = (batch, self.scene.n_workers, config.tracker)
        self.estimates = tuple(oracle.estimate_prior(*made) for _ in (0.0, *config.forecast_s))
        """Estimates of the workers: the current estimate, and a forecast for each of
        `forecast_s`."""
        self.identities = metrics.make_identities(batch, self.scene.n_workers)
        self.keys: list[str] = []
        robot = chains.robot_state(self.chain, self.physics.q, self.physics.qd)
        self.measured = handling.make_world(self.physics, self._everyone, robot).objects
        """The last measurement of the task's loose objects; None for a task without loose
        objects."""
        self.streams = {name: [np.random.default_rng(0)] * batch for name in (*STREAMS, MEASURING)}

    def reset(
        self, ids: Ints, rngs: Sequence[np.random.Generator], fixed: Sequence[Fixed | None] = ()
    ) -> StepResult:
        """Begin new episodes of environments `ids`.

        Args:
            ids: (n,) sorted indices of the environments.
            rngs: n random generators, one for each of these environments.
            fixed: fixed parts of each episode; empty if there are none.

        Returns:
            The result of these environments, with n rows.
        """
        given = {b: each for b, each in zip(ids.tolist(), fixed, strict=False) if each is not None}
        self._spawn_streams(ids, rngs)
        self.cameras.assign(ids, given, self.streams["sensor"])
        truth = self._begin(ids, given)
        belief = self._perceive(truth)
        return self._open(truth, belief)

    def step(self, action: Floats) -> StepResult:
        """Advance every environment by one control step.

        Args:
            action: (B, A) actions in [-1, 1].
        """
        command = self._act(action)
        truth = self._move(command)
        belief = self._perceive(truth)
        return self._judge(command, truth, belief)

    def fix(self, options: Options) -> Fixed:
        """Check the options of one environment's reset, and return the fixed parts of its episode.

        Raises:
            ConfigError: an option is invalid, or two options are incompatible.
        """
        room = Room(
            task=self.task,
            scene=self.scene,
            chain=self.chain,
            level=self.perception,
            faults=self.config.faults,
            appearance=self.config.appearance,
            bodies=self.bodies.names,
            mind=self.motion.mind,
            find_contact=self.physics.find_contact,
            images=self.images,
            wants_pairs=self._wants_pairs,
        )
        return fix(options, room)

    def set_reward(
        self, weights: RewardConfig | None = None, factors: Mapping[str, float] | None = None
    ) -> None:
        """Set the weights of the reward's terms from the next step on.

        Args:
            weights: weights of the terms that all tasks share; None keeps them.
            factors: factors by which terms are multiplied, by name, including terms of the task;
                all other terms have the factor 1. None keeps the factors.

        Raises:
            ConfigError: a term is unknown, or a factor is not a finite number.
        """
        if not isinstance(weights, RewardConfig | None):
            raise ConfigError(
                f"weights must be a RewardConfig, got {weights!r}; to scale terms by name, use "
                'set_reward(factors={"NAME": 2.0}).'
            )
        checked = (
            None if factors is None else rewards.check_factors(factors, self.task.reward_terms)
        )
        self.reward_weights = self.reward_weights if weights is None else weights
        self.reward_factors = self.reward_factors if checked is None else checked

    def rig_of(self, b: int) -> tuple[CameraConfig, ...]:
        """Return the rig of environment `b` in its current episode."""
        return self.cameras.rig_of(b)

    def cameras_of(self, b: int) -> tuple[PinholeCamera, ...]:
        """Return the pinhole cameras of environment `b` in its current episode."""
        return self.cameras.cameras_of(b)

    def get_state(self) -> State:
        """Return a copy of the complete state, including random generators and settings."""
        return {"settings": self.settings, **super().get_state(), **self._own_factors()}

    def get_rows(self, ids: Ints, batch: int) -> State:
        """Return a copy of the state of environments `ids`, without settings."""
        return {**super().get_rows(ids, batch), **self._own_factors()}

    def set_state(self, state: State) -> None:
        """Restore the exact state that `get_state` returned with the same settings."""
        self.check_settings(state["settings"])
        super().set_state(state)
        self.reward_factors = dict(state.get("reward_factors", {}))

    def check_settings(self, settings: State, *others: str) -> None:
        """Raise `ConfigError` if a state was taken with other settings.

        Args:
            settings: the settings of the state.
            others: names of settings that may differ.
        """
        for name in {**self.settings, **settings}:
            taken, value = settings.get(name), self.settings.get(name)
            if taken != value and name not in others:
                raise ConfigError(
                    f"The state was taken with {name}={taken!r}, but here {name} is {value!r}. "
                    "Create the environment with the same arguments."
                )

    def restart_streams(self, ids: Ints, rngs: Sequence[np.random.Generator]) -> None:
        """Spawn the random streams of environments `ids` anew, in the middle of their episodes.

        What has been sampled for the whole episode stays: rig, faults and appearance.

        Args:
            ids: (n,) indices of the environments.
            rngs: n random generators, one for each of these environments.
        """
        for b, rng in zip(ids.tolist(), rngs, strict=True):
            spawned = zip(STREAMS, children(rng, len(STREAMS)), strict=True)
            fresh: dict[str, np.random.Generator] = dict(spawned)
            if self.measured is not None:
                fresh[MEASURING] = fresh["task"].spawn(1)[0]
            for name, stream in fresh.items():
                restart(self.streams[name][b], stream)

    def draw_images(self) -> Images:
        """Render the images in the observation at the time of the sensors' last exposure."""
        return self.cameras.draw_images(self.streams["sensor"])

    def look_of(self, b: int) -> Look | None:
        """Return the appearance sampled for environment `b`; None for the scene as built."""
        return self.cameras.look_of(b, self.streams["sensor"][b])

    def close(self) -> None:
        """Release threads and graphics contexts."""
        self.cameras.close()

    @property
    def pipeline(self) -> PerceptionPipeline:
        """Perception pipeline of the current episodes."""
        return self.cameras.pipeline

    @property
    def images(self) -> ObservedImages | None:
        """Renderer of the images in observations; None without images."""
        return self.cameras.images

    @property
    def estimate(self) -> PoseEstimate:
        """Current estimate of the workers."""
        return self.estimates[0]

    @property
    def terms(self) -> tuple[observations.ObservationTerm, ...]:
        """Terms of the observation, in order."""
        more = observations.SHIELD_TERMS if self.config.observe_shield else ()
        return (*self.task.observation_terms, *more)

    @property
    def present(self) -> Bools:
        """Mask (B, W) of the workers that are in the scene."""
        return generator.activity(self.motion) != generator.ABSENT

    @property
    def belief(self) -> Belief:
        """Current belief of every robot."""
        robot = chains.robot_state(self.chain, self.physics.q, self.physics.qd)
        world = handling.make_world(self.physics, self._everyone, robot)
        return self._believe(self._everyone, self._load(world), self.estimates)

    def markers(self, b: int) -> Points3:
        """Return the positions (M, 3) of the markers of environment `b`'s task [m, world]."""
        view = self.task.view(self.task_state, np.array([b]))
        return self.task.markers(view)[0]

    def _own_factors(self) -> State:
        """Return the factors of reward terms as a part of the state, if there are any."""
        return {"reward_factors": self.reward_factors} if self.reward_factors else {}

    def _make_people_and_scene(self, settings: Settings) -> None:
        """Make the workers and the scene; raise `ConfigError` if it lacks space for workers."""
        config, (fewest, most) = settings.config, settings.n_workers
        build_scene = partial(
            build,
            config.scene,
            settings.scene,
            bodies=self.bodies.names,
            cameras=settings.cameras,
            robot=settings.robot,
            task_scene=self.task.make_scene(),
        )
        grounds = build_scene(n_workers=0).grounds
        try:  # before the scene, because this checks the space for workers and clips
            self.motion = generator.make_state(
                self.batch,
                most,
                self.bodies,
                config.motion,
                grounds,
                fewest,
                settings.robot.base_radius_m,
            )
        except NoRoomError as error:
            scenes = all_grounds(config.scene)
            played = fit.measure_played_s(error.clip, scenes, config.worker, config.motion)
            fitting = fit.describe_fit(error.clip, played)
            raise ConfigError(f"{error} {fitting}") from None
        self.scene: Scene = build_scene(n_workers=most)

    def _spawn_streams(self, ids: Ints, rngs: Sequence[np.random.Generator]) -> None:
        """Spawn the random streams of environments `ids`."""
        for b, rng in zip(ids, rngs, strict=True):
            for name, stream in zip(STREAMS, children(rng, len(STREAMS)), strict=True):
                self.streams[name][b] = stream
            if self.measured is not None:
                self.streams[MEASURING][b] = self.streams["task"][b].spawn(1)[0]

    def _begin(self, ids: Ints, given: Mapping[int, Fixed]) -> Truth:
        """Reset workers, robots, objects and the task of environments `ids`.

        Args:
            ids: (n,) indices of the environments.
            given: fixed parts of the episodes by environment.
        """
        self.action[ids], self.episode_cost[ids], self.separation_m[ids] = 0.0, 0.0, 0.0
        self.shield_change[ids] = 0.0
        self.monitor.reset(ids)
        people, task_rngs = (self.motion, self.streams["motion"]), self.streams["task"]
        casts = {b: each.cast for b, each in given.items() if each.cast is not None}
        draw = partial(self._draw_starts, given=given) if given else self._draw_starts
        q = starts.begin_apart(ids, draw, *people, self.chain, self.bodies, casts)
        robot = chains.robot_state(self.chain, q, np.zeros_like(q))
        self.task.reset(self.task_state, ids, task_rngs, World(robot, place=self.place))
        for b, each in given.items():
            if each.goal is not None:
                q_b = q[ids == b]
                robot_b = chains.robot_state(self.chain, q_b, np.zeros_like(q_b))
                world = World(robot_b, place=self.place)
                self.task.set_goal(self.task_state, np.array([b]), each.goal[None], world)
        poses = self.task.object_poses(self.task_state, ids)
        if poses is not None:
            expected = (len(ids), len(self.scene.objects.names), 7)
            check_shape(
                f"{self.task.id}: object_poses", np.shape(poses), expected, "of each object"
            )
        self.physics.reset(ids, q, self.motion.workers["body"][ids], poses)
        self.cameras.reset(ids, self.streams["sensor"], self.streams["tracker"])
        world = handling.make_world(self.physics, ids, robot)
        motion = generator.current(self.motion, ids)
        return Truth(ids, world, motion, worker_truth(self.bodies, motion))

    def _act(self, action: Floats) -> Command:
        """Convert actions to joint velocities, which the shield may change based on the belief."""
        previous, self.action = self.action, np.array(action, float)
        command = joint_command(
            self.control,
            self.action[:, : self.n_actions - self._grips],
            self.physics.q,
            self.chain,
            self.scene.home_q,
            self.config.control,
        )
        if self.shield is None:
            return Command(command, previous, {})
        allowed, info = apply_shield(self.shield, self.belief, command, self.config.ctrl_dt)
        self.shield_change = allowed - command
        return Command(allowed, previous, dict(info))

    def _move(self, command: Command) -> Truth:
        """Advance workers, robots and the task by one control step."""
        config, task = self.config, self.task
        path, motion = generator.advance(
            self.motion, self.streams["motion"], config.scene.sim_dt, config.n_substeps
        )
        far = self.separation_m > CLOSING_M_S * config.ctrl_dt
        self.physics.apply(task.effects(self.task_state))
        grip = self.action[:, -1] if self._grips else None
        q_path = self.physics.step(command.velocities, path, far, grip)
        workers = worker_truth(self.bodies, motion)
        n = self.chain.n_joints
        robot, arm = chains.robot_path(self.chain, q_path[..., :n], self.physics.qd)
        world = handling.make_world(self.physics, self._everyone, robot)
        world, arm = handling.attach_load(
            self.scene, world, arm, q_path, task.is_load(self.task_state)
        )
        progress = self._show_workers(world, motion)
        around = worker_capsules(self.bodies, path, motion.body), workers.capsule_radius_m
        paths = incidents.measure_paths(arm, world.robot.capsule_radius_m, *around)
        touched = paths.gaps_m.min((1, 2), initial=np.inf) <= 0.0
        world = change_fields(world, workers=progress, touched=touched, place=self.place)
        task_step = task.advance(self.task_state, self.streams["task"], world, config.ctrl_dt)
        return Truth(self._everyone, world, motion, workers, paths, task_step)

    def _show_workers(self, world: World, motion: WorkerMotion) -> WorkerProgress | None:
        """Let workers observe robot and signals; return their progress if they wait for signals."""
        seen_world = world.robot.capsules_world[:, self.scene.watched_capsules, 1]
        signal = self.task.signal(self.task_state)
        generator.watch(self.motion, seen_world, motion, self.config.ctrl_dt, signal)
        return None if signal is None else generator.progress(self.motion, motion)

    def _perceive(self, truth: Truth) -> Belief:
        """Expose the cameras, update the estimates, measure objects, and return the belief."""
        ids, everyone = truth.ids, truth.ids is self._everyone
        self._expose(truth)
        sensor, tracker = self.streams["sensor"], self.streams["tracker"]
        if not everyone:
            sensor, tracker = select_streams(sensor, ids), select_streams(tracker, ids)
        estimate = self.pipeline.perceive(ids, sensor, tracker)
        later = (self.pipeline.forecast(estimate, ids, t) for t in self.config.forecast_s)
        estimates = (estimate, *later)
        if everyone:
            self.estimates = estimates
        else:
            for whole, part in zip(self.estimates, estimates, strict=True):
                write_rows(whole, ids, part)
        if truth.world.objects is not None:
            rngs = select_streams(self.streams[MEASURING], ids)
            measured = handling.measure_objects(truth.world.objects, rngs, self.config.objects)
            write_rows(self.measured, ids, measured)
        return self._believe(ids, truth.world, estimates)

    def _expose(self, truth: Truth) -> None:
        """Expose the sensor; no other part of the perception has access to the true state."""
        ids, sensor = truth.ids, self.pipeline.sensor
        now = SensorInput(ids, self.physics.qpos[ids], truth.motion)
        if sensor.NEEDS_TRUTH:
            present = self.motion.workers["is_present"][ids]
            now = TrueSensorInput(ids, now.qpos, now.motion, truth.workers, present)
        sensor.expose(now)

    def _believe(self, ids: Ints, world: World, estimates: tuple[PoseEstimate, ...]) -> Belief:
        """Return the belief of the robots of environments `ids`.

        Args:
            ids: (n,) indices of the environments.
            world: true state of these environments, from which only the readings of encoders and
                grippers are used.
            estimates: estimate of the workers, and its forecasts.
        """
        estimate = estimates[0]
        unseen = find_unseen_floor(world.robot, estimate, self.pipeline.vacancy(ids))
        belief = Belief(
            robot=world.robot,
            estimate=drop_distant_unknown(estimate, unseen),
            separation=estimated_separation(world.robot, estimate),
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
        return change_fields(belief, allowed_contact=self.task.allowed_contact(belief))

    def _open(self, truth: Truth, belief: Belief) -> StepResult:
        """Return the initial observations and infos of new episodes."""
        ids, task, world = truth.ids, self.task, truth.world
        present, nothing = self.present[ids], np.zeros(len(ids))
        identities = metrics.make_identities(*present.shape)
        terms = (*task.own_rewards, *rewards.SHARED_TERMS)
        still = np.zeros((len(ids), self.chain.n_joints))
        info = check_keys(self.keys, {
            **infos.reset_info(world.robot, truth.workers, present, terms, self.config.cost),
            **infos.tracking_info(rows(self.estimate, ids), truth.workers, present, identities),
            **apply_shield(self.shield, belief, still, self.config.ctrl_dt)[1],
            **self._episode_info(ids, generator.activity(self.motion), None),
        })  # fmt: skip
        write_rows(self.identities, ids, identities)
        return StepResult(self._observe(belief), nothing, nothing > 0, info)

    def _judge(self, command: Command, truth: Truth, belief: Belief) -> StepResult:
        """Compute cost and metrics from the true state, reward and observation from the belief."""
        config, paths = self.config, require(truth.paths, "The true paths of a step")
        cost = measure_cost(paths.gaps_m, config.cost)
        happened = self.monitor.step(truth.world, paths)
        pushed = self.monitor.find_pushed(truth.world, paths, command.velocities)
        terms = self._reward_terms(command, truth, belief)
        activity = generator.activity(self.motion)
        present = activity != generator.ABSENT
        counted = infos.cost_info(cost, happened, pushed, present, config.cost)
        self.episode_cost += counted["cost"]
        self.separation_m = cost.min_separation_m
        info = check_keys(self.keys, {
            **{f"reward/{name}": value for name, value in terms.items()},
            **counted,
            **infos.incident_info(happened, self.monitor, truth.world.robot),
            **infos.tracking_info(self.estimate, truth.workers, present, self.identities),
            **command.shield_info,
            **self._episode_info(truth.ids, activity, happened),
        })  # fmt: skip
        over = (cost.contact > 0) & config.cost.contact_terminates
        over |= self._is_terminal(truth.task_step)
        return StepResult(self._observe(belief), rewards.sum_terms(terms, self.batch), over, info)

    def _is_terminal(self, task_step: Any) -> Bools:
        """Return a mask (B,) of the environments in which the task ends the episode."""
        over = np.asarray(self.task.is_terminal(task_step))
        if over.ndim:
            name = f"{self.task.id}: is_terminal"
            check_shape(name, over.shape, (self.batch,), "one entry per environment")
        return over.astype(bool)

    def _draw_starts(self, ids: Ints, given: Mapping[int, Fixed] = NOTHING_GIVEN) -> JointAngles:
        """Return the initial joint angles (n, N) of robots `ids`, sampled or fixed by options."""
        rngs = select_streams(self.streams["robot"], ids)
        q = self.task.draw_start(rngs, self.place, self.scene.home_q, self._spread_rad)
        expected = (len(ids), self.chain.n_joints)
        check_shape(f"{self.task.id}: draw_start", np.shape(q), expected, "one angle per joint")
        q = np.array(q) if given else q
        for row, b in enumerate(ids.tolist() if given else ()):
            if b in given and given[b].start_q is not None:
                q[row] = given[b].start_q
        return q

    def _load(self, world: World) -> World:
        """Return the true state with carried loads as parts of the robots."""
        arm, qpos = world.robot.capsules_world[:, None], self.physics.qpos[:, None]
        return handling.attach_load(
            self.scene, world, arm, qpos, self.task.is_load(self.task_state)
        ).world

    def _observe(self, belief: Belief) -> Observation:
        """Compute the observations, which are a dictionary if there are goals or images."""
        flat = observations.observe(belief, self.layout, self.terms)
        separate_goal = self.task.goal
        if separate_goal is None and self.images is None:
            return flat
        goals = {} if separate_goal is None else goal.observe_goal(separate_goal, belief)
        return {
            **goals,
            **self.cameras.draw_images(self.streams["sensor"]),
            observations.FLAT: flat,
        }

    def _reward_terms(self, command: Command, truth: Truth, belief: Belief) -> dict[str, Floats]:
        """Compute the terms (B,) of the reward by name: those of the task, then the shared ones."""
        own, shared = self.task.own_rewards, rewards.SHARED_TERMS
        step = truth.task_step, command.previous_action
        terms = {
            **rewards.evaluate_terms(own, belief, *step, self.config.task),
            **rewards.evaluate_terms(shared, belief, *step, self.reward_weights),
        }
        for name, factor in self.reward_factors.items():
            terms[name] = factor * np.asarray(terms[name])
        return terms

    def _episode_info(self, ids: Ints, activity: Ints, happened: Records2[Incident] | None) -> Info:
        """Return the infos of the current episodes of environments `ids`.

        Args:
            ids: (n,) indices of the environments.
            activity: (B, W) index of each worker's activity.
            happened: (B, W) incidents of the step; None in a reset.
        """
        tally = {"episode_cost": self.episode_cost, **self.task.info(self.task_state)}
        body, cameras, seen = self.motion.workers["body"], self.settings["cameras"], self.pipeline
        return {
            **{name: value[ids] for name, value in tally.items()},
            **infos.worker_info(activity[ids], body[ids], happened),
            **infos.perception_info(cameras, seen.suspected_cameras(ids), seen.vacancy(ids)),
            **self.cameras.info(ids),
        }
