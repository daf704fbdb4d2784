"""Physics of a batch of copies of one scene, with commanded robots and moving workers.

The complete state is in the rows of one `mujoco.batch.Batch`, for any batch size: a copy of the
rows is a copy of the simulation, and results do not depend on the other environments of a batch.
"""

import ctypes
import math
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco.batch import Batch

from hrc_env.core.declared import Records1, dtype_of, make_records
from hrc_env.core.errors import ConfigError, HRCError, check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.records import HandState, WorkerPath
from hrc_env.core.typing import Bools, Floats, Ints, JointAngles, JointVelocities, Points3
from hrc_env.geometry.chains import tool_frame
from hrc_env.scene.build import Scene, without_workers
from hrc_env.scene.cups import Cups, find_sealed, measure_load_n
from hrc_env.scene.limits import slew_rad_s2
from hrc_env.scene.objects import find_held
from hrc_env.scene.robot import PREFIX
from hrc_env.scene.worker import CAPSULE_FIELDS, capsule_shapes
from hrc_env.world import Effects

COMMANDS = int(mujoco.mjtState.mjSTATE_CTRL)
"""MuJoCo's state flags of the inputs of a substep without workers: servo commands."""
INPUTS = COMMANDS | int(mujoco.mjtState.mjSTATE_MOCAP_POS | mujoco.mjtState.mjSTATE_MOCAP_QUAT)
"""MuJoCo's state flags of the inputs of a substep with workers: servo commands and poses of worker
bodies."""
ARM_FIELDS = ("time", "qpos", "qvel", "act", "qacc_warmstart")
"""Fields of MuJoCo's state that determine the motion of the robot."""
OBJECT_FIELDS = ("eq_active", "xfrc_applied")
"""Further fields of MuJoCo's state that determine the motion of loose objects."""
PRESSING_N = 40.0
"""Force above which fingers count as pressing on an object [N]."""
RESTING_M_S = 0.01
"""Speed below which fingers are at rest [m/s]; fingers that press and are at rest count as
closed."""
END_MARGIN_RAD = 0.02
"""Distance from the end of the range at which a joint is stopped [rad], or [m] for a slide."""
BRAKE_SHARE = 0.7
"""Fraction of the slew limit with which joints brake before the ends of their ranges."""


class Servo:
    """Limits and servo parameters of a joint.

    The units are those of a hinge; for a slide, [m] replaces [rad].
    """

    low: float
    """Lower end of the joint's range [rad]."""
    high: float
    """Upper end of the joint's range [rad]."""
    fastest: float
    """Velocity limit [rad/s]."""
    slew: float
    """Limit on the rate of change of the commanded velocity [rad/s^2]."""
    lead: float
    """Lead time of the rate servo [s]."""
    clamp: float
    """Limit on the difference between the angles of the holding servo and the joint [rad]."""


SERVO = dtype_of(Servo)


class SharedField(NamedTuple):
    """Views of one MuJoCo field in the simulations without and with workers."""

    alone: Floats
    """(B, ...) field in the simulations without workers."""
    beside: Floats
    """(B, ...) the same entries in the simulations with workers, in which worker bodies come
    last."""


class Saved(NamedTuple):
    """Content of a pickled `Physics` object."""

    scene: Scene
    """Scene of the simulations."""
    batch: int
    """Number of simulations, B."""
    state: Floats
    """(B, n) complete state."""


class Physics:
    """A batch of B simulations of a scene.

    Args:
        scene: the scene.
        batch: number of simulations, B.
    """

    def __init__(self, scene: Scene, batch: int) -> None:
        if batch < 1:
            raise ConfigError(f"Physics needs at least one environment, got {batch}.")
        _stop_profiling()
        self.scene, self.batch = scene, batch
        self._n, self._servos = scene.chain.n_joints, _make_servos(scene)
        self._sims = Batch(scene.model, nsim=batch, nthread=1)
        self._alone = Batch(without_workers(scene).model, nsim=batch, nthread=1)
        fields = ARM_FIELDS + (OBJECT_FIELDS if scene.objects.names else ())
        self._shared = [_bind_shared(self._alone, self._sims, field) for field in fields]
        self._qpos, self._qvel = self._sims.bind("qpos"), self._sims.bind("qvel")
        self._welded = self._sims.bind("eq_active")
        self._push = self._sims.bind("xfrc_applied") if scene.objects.names else np.zeros(0)
        self._records = ("qpos", "sensordata") if scene.cups else ("qpos",)
        self._is_separable = self._alone.bind("eq_active").shape == self._welded.shape
        self._act, kept = self._sims.bind("act"), self._sims.bind("userdata")
        self._command, self._body = kept[:, : self._n], kept[:, self._n : self._n + scene.n_workers]
        self._grip = kept[:, self._n + scene.n_workers :]
        several = len(scene.bodies) > 1
        self._shapes = {name: self._sims.expand(name) for name in CAPSULE_FIELDS if several}
        self._control, self._trace = np.zeros((batch, 0, 0)), np.zeros((batch, 0, 0))
        self.reset(np.arange(batch), np.tile(scene.home_q, (batch, 1)))

    @property
    def q(self) -> JointAngles:
        """Copy of the joint angles (B, N) of the robots [rad]."""
        return self._qpos[:, : self._n].copy()

    @property
    def qd(self) -> JointVelocities:
        """Copy of the joint velocities (B, N) of the robots [rad/s]."""
        return self._qvel[:, : self._n].copy()

    @property
    def command(self) -> JointVelocities:
        """Copy of the commanded joint velocities (B, N) [rad/s]."""
        return self._command.copy()

    @property
    def qpos(self) -> Floats:
        """Copy of the generalized positions (B, nq) of robot [rad], fingers [m] and objects."""
        return self._qpos.copy()

    @property
    def qvel(self) -> Floats:
        """Copy of the generalized velocities (B, nv) of robot, fingers and objects."""
        return self._qvel.copy()

    def hand_state(self, ids: Ints) -> HandState | None:
        """Return the state of the hands of environments `ids`; None if the robot has none."""
        hand, cups = self.scene.grip, self.scene.cups
        if cups is not None:
            load, sealed = self._grip[ids, 0], self._welded[ids][:, cups.welds].any(1)
            return HandState(np.zeros(len(ids)), load.copy(), sealed)
        if hand is None:
            return None
        opening_m = self._qpos[ids][:, hand.fingers].mean(1)
        rate_m_s = self._qvel[ids][:, hand.fingers].mean(1)
        push_n = hand.stiffness_n_m * (self._grip[ids, 0] - opening_m)
        force_n = np.clip(hand.damping_n_s_m * rate_m_s - push_n, -hand.most_n, hand.most_n)
        still = np.abs(rate_m_s) < RESTING_M_S
        return HandState(opening_m, force_n, (force_n > PRESSING_N) & still)

    def held(self, ids: Ints, tool_world: Points3, hand: HandState) -> Bools:
        """Return a mask (n, O) of the objects that the hands of environments `ids` (n,) hold.

        Args:
            ids: (n,) indices of the environments.
            tool_world: (n, 3) tool points of the robots [m].
            hand: state of the hands.
        """
        objects, cups = self.scene.objects, self.scene.cups
        if cups is None:
            return find_held(objects, self._qpos[ids], tool_world, hand)
        held = np.zeros((len(ids), len(objects.names)), bool)
        held[:, cups.objects] = self._welded[ids][:, cups.welds] > 0.0
        return held

    def apply(self, effects: Effects | None) -> None:
        """Apply a task's welds and forces on objects until the next call; None keeps them."""
        if effects is None:
            return
        for name, is_on in effects.welded.items():
            self._welded[:, self.scene.model.equality(name).id] = is_on
        self._push[:, self.scene.object_bodies] = effects.push_world

    def _switch_cups(self, cups: Cups, is_on: Bools) -> None:
        """Activate cups if `is_on` (B,), else vent them; overloaded cups lose their object."""
        q, welded = self._qpos[:, : self._n], self._welded[:, cups.welds] > 0.0
        tool, poses = tool_frame(self.scene.chain, q), self.scene.objects.poses(self._qpos)
        near = find_sealed(cups, tool, poses)
        torn = self._grip[:, :1] > cups.limit_n
        self._welded[:, cups.welds] = is_on[:, None] & (welded | near) & ~(welded & torn)

    def reset(
        self, ids: Ints, q: JointAngles, body: Ints | None = None, poses: Floats | None = None
    ) -> None:
        """Reset environments to a state at rest, with open hands.

        Args:
            ids: (n,) sorted indices of the environments.
            q: (n, N) joint angles of the robots [rad].
            body: (n, W) index of each worker's body in the scene's `bodies`; None for the first.
            poses: (n, O, 7) poses of loose objects; None for those of the task's MJCF.
        """
        ids = np.asarray(ids, int)
        check_shape("q", np.shape(q), (len(ids), self._n), "one row per id, one entry per joint")
        for sims in (self._sims, self._alone):
            sims.reset(ids, stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        self._qpos[ids, : self._n] = q
        self._act[ids, : self._n] = q
        if (hand := self.scene.grip) is not None:
            self._qpos[ids[:, None], hand.fingers] = self._grip[ids] = hand.open_m
        if poses is not None:
            self._qpos[ids, self.scene.objects.first :] = poses.reshape(len(ids), -1)
        self._body[ids] = 0 if body is None else body
        self._set_capsules(ids)

    def step(
        self,
        qd_command: JointVelocities,
        workers: WorkerPath,
        out_of_reach: Bools | None = None,
        grip: Floats | None = None,
    ) -> Floats:
        """Advance every environment by one control step.

        Args:
            qd_command: (B, N) desired joint velocities [rad/s]; their magnitude and slew are
                limited, and they are reduced near the ends of the joints' ranges.
            workers: poses of the workers after every substep, arrays (B, T, W, S, ...); W may be 0.
            out_of_reach: (B,) whether no worker can touch the robot in this step, for which the
                simulation without workers gives the same result faster; None if this applies to no
                environment.
            grip: (B,) command of the hands from -1 (open) to 1 (closed); cups are active above 0.
                None for open hands.

        Returns:
            (B, T, nq) `qpos` after every substep.

        Raises:
            ConfigError: the arrays have wrong shapes.
            HRCError: the physics became unstable; the error names the reason.
        """
        check_shape("qd_command", np.shape(qd_command), (self.batch, self._n), "batch, joints")
        self._check_workers(workers)
        n = self._n
        _substep_commands(
            self._qpos[:, :n],
            self._qvel[:, :n],
            self._act[:, :n],
            self._command,
            np.asarray(qd_command, float),
            self._servos,
            self.scene.config.sim_dt,
            self._control,
        )
        wanted = np.full(self.batch, -1.0) if grip is None else np.nan_to_num(grip, nan=-1.0)
        if self.scene.grip is not None:
            share = 0.5 * (1.0 - np.clip(wanted, -1.0, 1.0))
            self._grip[:, 0] = share * self.scene.grip.open_m
        if self.scene.cups is not None:
            self._switch_cups(self.scene.cups, wanted > 0.0)
        alone = np.zeros(self.batch, bool)
        if out_of_reach is not None and self._is_separable:
            alone = out_of_reach
        self._simulate(~alone, workers)
        self._simulate(alone, None)
        self._check_health()
        return self._trace.copy()

    def find_contact(self, q: JointAngles) -> str | None:
        """Return the names of two geoms in contact if the robot is at angles q (N,) [rad].

        Self-collisions of the robot count as contacts. Loose objects have the poses of the MJCF,
        and there are no workers. Return None if there is no contact.
        """
        model = without_workers(self.scene).model
        data = mujoco.MjData(model)
        data.qpos[: self._n] = q
        mujoco.mj_forward(model, data)
        for contact in data.contact[: data.ncon]:
            names = [model.geom(geom).name for geom in contact.geom]
            if contact.dist < 0.0 and any(name.startswith(PREFIX) for name in names):
                return " and ".join(name.removeprefix(PREFIX) or "something" for name in names)
        return None

    def get_state(self) -> Floats:
        """Return the complete state (B, n), which `set_state` restores exactly."""
        return self._sims.state.copy()

    def get_rows(self, ids: Ints, batch: int) -> Floats:
        """Return the complete state (n, ...) of environments `ids` (n,)."""
        return self._sims.state[ids]

    def set_state(self, state: Floats) -> None:
        """Restore a state from `get_state` of the same scene and batch size."""
        check_shape("state", np.shape(state), self._sims.state.shape, "batch, state")
        self._sims.state[:] = state
        self._set_capsules(np.arange(self.batch))

    def __getstate__(self) -> "Saved":
        return Saved(self.scene, self.batch, self.get_state())

    def __setstate__(self, saved: "Saved") -> None:
        self.__init__(saved.scene, saved.batch)
        self.set_state(saved.state)

    def _set_capsules(self, ids: Ints) -> None:
        """Set the workers' capsules in environments `ids` to those of their bodies."""
        body, geoms = self._body[ids].astype(np.int64), self.scene.worker_capsules
        known = capsule_shapes(self.scene.bodies) if self._shapes else {}
        for name, shapes in self._shapes.items():
            shapes[ids[:, None, None], geoms] = known[name][body]

    def _check_workers(self, workers: WorkerPath) -> None:
        """Check the shape of a path, and resize the buffers for its number of substeps."""
        rows, n_substeps = self.scene.worker_mocap, workers.position_world.shape[1]
        expected = (self.batch, max(n_substeps, 1), *rows.shape[:1])
        meaning = "batch, substeps (at least one), workers"
        check_shape("workers.position_world", workers.position_world.shape[:3], expected, meaning)
        if self._control.shape[1] != n_substeps:
            model = self.scene.model
            self._control = np.zeros((self.batch, n_substeps, 2 * self._n))
            self._trace = np.zeros((self.batch, n_substeps, model.nq))

    def _simulate(self, is_selected: Bools, workers: WorkerPath | None) -> None:
        """Simulate selected environments (B,), without workers if `workers` is None."""
        n = np.count_nonzero(is_selected)
        if n == 0:
            return
        ids = None if n == len(is_selected) else np.flatnonzero(is_selected)
        rows = slice(None) if ids is None else ids  # a slice needs no copy
        sims, inputs, control = self._alone, COMMANDS, self._control[rows]
        if self.scene.grip is not None:
            grip = np.broadcast_to(self._grip[rows, None], (*control.shape[:2], 1))
            control = np.concatenate([control, grip], axis=2)
        shared = self._shared if workers is None else []
        if workers is not None:
            lead, sims, inputs = (*control.shape[:2], -1), self._sims, INPUTS
            paths = workers.position_world[rows], workers.quaternion_wxyz[rows]
            control = np.concatenate([control, *(path.reshape(lead) for path in paths)], axis=2)
        for alone, beside in shared:
            alone[rows] = beside[rows]
        trace = sims.rollout(control.shape[1], control, inputs, self._records, ids)
        self._trace[rows] = trace["qpos"]
        if (cups := self.scene.cups) is not None:
            self._grip[rows, 0] = measure_load_n(cups, trace["sensordata"]).max(axis=1)
        for alone, beside in shared:
            beside[rows] = alone[rows]

    def _check_health(self) -> None:
        """Raise `HRCError` if MuJoCo warns of a diverging state or insufficient memory."""
        for sims in (self._sims, self._alone):
            if np.count_nonzero(sims.warning):
                environment, kind, _ = np.argwhere(sims.warning)[0]
                raise HRCError(
                    f"The physics of environment {environment} became unstable "
                    f"({mujoco.mjtWarning(int(kind)).name}): expected finite states and bounded "
                    "contacts; reset it, and check its commands."
                )


@cache
def _stop_profiling() -> None:
    """Remove the clock that MuJoCo's Python package reads many times per substep.

    The clock serves profiling only (`mjData.timer`) and takes about an eighth of the time of a
    substep. `mujoco.set_mjcb_time(None)` does not remove it; `mujoco.set_mjcb_time(time.time)`
    installs one again.
    """
    with suppress(OSError, StopIteration, ValueError):  # another build, which keeps its clock
        library = next(Path(mujoco.__file__).parent.glob("libmujoco*"))
        ctypes.c_void_p.in_dll(ctypes.CDLL(str(library)), "mjcb_time").value = None


def _bind_shared(alone: Batch, beside: Batch, field: str) -> SharedField:
    """Bind views of a field in simulations without and with workers."""
    less, more = alone.bind(field), beside.bind(field)
    return SharedField(less, more[:, : less.shape[1]] if less.ndim > 1 else more)


def make_empty_path(batch: int, n_substeps: int) -> WorkerPath:
    """Return a path without workers, arrays (B, T, 0, 22, ...), for scenes without workers."""
    shape = (batch, n_substeps, 0, 22)
    return WorkerPath(np.zeros((*shape, 3)), np.zeros((*shape, 4)))


def _make_servos(scene: Scene) -> Records1[Servo]:
    """Return the limits and servo parameters (N,) of the joints of a scene's robot."""
    servos, config, chain = make_records(Servo, scene.chain.n_joints), scene.config, scene.chain
    servos["low"], servos["high"] = chain.range_rad.T
    servos["fastest"], servos["lead"] = chain.velocity_limit_rad_s, scene.servo_lead_s
    servos["slew"] = slew_rad_s2(scene)
    servos["clamp"] = config.integrator_clamp_rad
    return servos


@kernel
def _substep_commands(
    q: JointAngles,
    qd: JointVelocities,
    held: JointAngles,
    command: JointVelocities,
    wanted: JointVelocities,
    servos: Records1[Servo],
    sim_dt: float,
    control: Floats,
) -> None:
    """Compute the servo commands of one control step within the limits of the joints.

    Velocities are limited in magnitude and slew, and near the ends of the joints' ranges. The
    command of the rate servo is advanced by its lead time, so that its torque provides the
    acceleration and the holding servo does not lag.

    Args:
        q: (B, N) joint angles [rad].
        qd: (B, N) joint velocities [rad/s].
        held: (B, N) angles of the holding servos [rad]; they are kept near those of a blocked
            robot, so that it can move immediately afterwards.
        command: (B, N) current command [rad/s], which is advanced by the control step.
        wanted: (B, N) desired velocities [rad/s]; values that are not finite count as 0.
        servos: (N,) limits and servo parameters of the joints.
        sim_dt: duration of a substep [s].
        control: (B, T, 2 N) output [rad/s]: for the holding servos the mean velocity of each
            substep, because its integral does not depend on the duration of a substep; then for the
            rate servos the velocity at the end of each substep.
    """
    n_substeps, n = control.shape[1], q.shape[1]
    ctrl_dt = sim_dt * n_substeps
    for b in range(q.shape[0]):
        for i in range(n):
            servo, angle = servos[i], q[b, i]
            held[b, i] = min(max(held[b, i], angle - servo.clamp), angle + servo.clamp)
            most, brake = servo.slew * sim_dt, BRAKE_SHARE * servo.slew
            reach = most * n_substeps
            velocity = min(max(command[b, i], qd[b, i] - reach), qd[b, i] + reach)
            target = wanted[b, i] if math.isfinite(wanted[b, i]) else 0.0
            target = min(servo.fastest, max(-servo.fastest, target))
            # v ctrl_dt + v^2 / (2 brake) = room: the greatest speed that still stops in time.
            room_up = max(0.0, servo.high - END_MARGIN_RAD - angle)
            room_down = max(0.0, angle - servo.low - END_MARGIN_RAD)
            fastest_up = brake * (math.sqrt(ctrl_dt**2 + 2 * room_up / brake) - ctrl_dt)
            fastest_down = brake * (math.sqrt(ctrl_dt**2 + 2 * room_down / brake) - ctrl_dt)
            target = min(fastest_up, max(-fastest_down, target))
            for t in range(n_substeps):
                change = min(most, max(-most, target - velocity))
                # Ramp for |change| / slew, then constant: the mean over the substep.
                control[b, t, i] = velocity + change * (1.0 - 0.5 * (abs(change) / most))
                velocity += change
                control[b, t, n + i] = velocity + servo.lead * change / sim_dt
            command[b, i] = velocity
