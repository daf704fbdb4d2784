"""Many copies of one scene, stepped together: the arm obeys, the workers walk.

Everything that changes lives in the state rows of one `mujoco.batch.Batch`, whatever the batch
size: copying them copies the simulation, and results do not depend on neighbours.
"""

import math

import mujoco
import numpy as np
from mujoco.batch import Batch

from hrc_env.core.errors import ConfigError, HRCError, check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.records import HandState, WorkerPath
from hrc_env.core.typing import Bools, Floats, Ints, JointAngles, JointVelocities, Points3, Records
from hrc_env.geometry.chains import tool_frame
from hrc_env.scene.build import Scene, without_workers
from hrc_env.scene.cups import Cups, load_n, seals
from hrc_env.scene.limits import slew_rad_s2
from hrc_env.scene.objects import held_by
from hrc_env.scene.robot import PREFIX
from hrc_env.scene.worker import CAPSULE_FIELDS, capsule_shapes
from hrc_env.world import Effects

COMMANDS = int(mujoco.mjtState.mjSTATE_CTRL)
"""What a substep without workers is given: servo commands."""
INPUTS = COMMANDS | int(mujoco.mjtState.mjSTATE_MOCAP_POS | mujoco.mjtState.mjSTATE_MOCAP_QUAT)
"""And with workers: then the places, then the turns of their bodies."""
OF_THE_ARM = ("time", "qpos", "qvel", "act", "qacc_warmstart")
OF_THINGS = ("eq_active", "xfrc_applied")
"""What of an environment's state the motion of the arm, and of what it handles, hangs on."""
SERVO = np.dtype(
    [(name, "f8") for name in ("low", "high", "fastest", "slew", "lead", "clamp")], align=True
)
"""A joint's lowest and highest angle [rad], velocity limit [rad/s], fastest change of the command
[rad/s^2], lead of its rate servo [s], and how far its holding servo may be ahead [rad]; a slide's
in metres."""
PRESSING_N, RESTING_M_S = 40.0, 0.01
"""Fingers that press with more [N] and move less [m/s] have closed on something."""
END_MARGIN_RAD = 0.02
"""Where a robot comes to rest before the end of a joint's range; a slide [m]."""
BRAKE_SHARE = 0.7
"""Share of the slew limit that stopping before an end counts on."""


class Physics:
    """B simulations of a scene."""

    def __init__(self, scene: Scene, batch: int) -> None:
        if batch < 1:
            raise ConfigError(f"Physics needs at least one environment, got {batch}.")
        self.scene, self.batch = scene, batch
        self._n, self._servos = scene.chain.n_joints, _servos(scene)
        self._sims = Batch(scene.model, nsim=batch, nthread=1)
        self._alone = Batch(without_workers(scene).model, nsim=batch, nthread=1)
        fields = OF_THE_ARM + (OF_THINGS if scene.objects.names else ())
        self._shared = [_both(self._alone, self._sims, field) for field in fields]
        self._qpos, self._qvel = self._sims.bind("qpos"), self._sims.bind("qvel")
        self._welded = self._sims.bind("eq_active")
        self._push = self._sims.bind("xfrc_applied") if scene.objects.names else np.zeros(0)
        self._records = ("qpos", "sensordata") if scene.cups else ("qpos",)
        self._parts = self._alone.bind("eq_active").shape == self._welded.shape
        self._act, kept = self._sims.bind("act"), self._sims.bind("userdata")
        self._command, self._body = kept[:, : self._n], kept[:, self._n : self._n + scene.n_workers]
        self._grip = kept[:, self._n + scene.n_workers :]
        several = len(scene.bodies) > 1
        self._shapes = {name: self._sims.expand(name) for name in CAPSULE_FIELDS if several}
        self._control, self._trace = np.zeros((batch, 0, 0)), np.zeros((batch, 0, 0))
        self.reset(np.arange(batch), np.tile(scene.home_q, (batch, 1)))

    @property
    def q(self) -> JointAngles:
        """(B, N) the arm's angles [rad], a copy."""
        return self._qpos[:, : self._n].copy()

    @property
    def qd(self) -> JointVelocities:
        """(B, N) the arm's velocities [rad/s], a copy."""
        return self._qvel[:, : self._n].copy()

    @property
    def command(self) -> JointVelocities:
        """(B, N) the joint velocities that are commanded now [rad/s], a copy."""
        return self._command.copy()

    @property
    def qpos(self) -> Floats:
        """(B, nq) the arm's angles [rad], its fingers' ways [m], loose objects' poses, a copy."""
        return self._qpos.copy()

    @property
    def qvel(self) -> Floats:
        """(B, nv) their rates, a copy."""
        return self._qvel.copy()

    def hand_state(self, ids: Ints) -> HandState | None:
        """What hands of environments `ids` feel; None: there are none."""
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
        """(len(ids), O) what hands hold."""
        objects, cups = self.scene.objects, self.scene.cups
        if cups is None:
            return held_by(objects, self._qpos[ids], tool_world, hand)
        held = np.zeros((len(ids), len(objects.names)), bool)
        held[:, cups.objects] = self._welded[ids][:, cups.welds] > 0.0
        return held

    def apply(self, effects: Effects | None) -> None:
        """Do to loose objects what a task does, until it does something else; None: go on."""
        if effects is None:
            return
        for name, on in effects.welded.items():
            self._welded[:, self.scene.model.equality(name).id] = on
        self._push[:, self.scene.object_bodies] = effects.push_world

    def _suck(self, cups: Cups, on: Bools) -> None:
        """Vent the cups, or let them seal; what is too heavy is torn off."""
        q, welded = self._qpos[:, : self._n], self._welded[:, cups.welds] > 0.0
        near = seals(cups, tool_frame(self.scene.chain, q), self.scene.objects.poses(self._qpos))
        torn = self._grip[:, :1] > cups.limit_n
        self._welded[:, cups.welds] = on[:, None] & (welded | near) & ~(welded & torn)

    def reset(
        self, ids: Ints, q: JointAngles, body: Ints | None = None, poses: Floats | None = None
    ) -> None:
        """Put environments `ids` (sorted) to rest at angles q (len(ids), N) [rad], hands open;
        their workers have bodies (len(ids), W) of the scene's, None: the first; objects lie at
        poses (len(ids), O, 7), None: as the task's MJCF has them."""
        ids = np.asarray(ids, int)
        check_shape("q", np.shape(q), (len(ids), self._n), "one row per id, one angle per joint")
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
        """One control step of every environment: (B, T, nq), `qpos` after every substep.

        Args:
            qd_command: (B, N) wanted joint velocities [rad/s]; limited in size and slew, and
                braked before the joints' ends, here.
            workers: after every substep, arrays (B, T, W, S, ...); W may be 0.
            out_of_reach: (B,) where no worker can touch the arm in this step (None: nowhere); it
                then moves as it would alone, bit for bit, and is quicker so.
            grip: (B,) from -1, open, to 1, closed; of cups, above 0 they suck. None: open.

        Raises:
            ConfigError: wrong shapes. HRCError: the physics broke down, with the reason.
        """
        check_shape("qd_command", np.shape(qd_command), (self.batch, self._n), "batch, joints")
        self._fit(workers)
        n = self._n
        _substep_commands(
            self._qpos[:, :n], self._qvel[:, :n], self._act[:, :n], self._command,
            np.asarray(qd_command, float), self._servos, self.scene.config.sim_dt,
            self._control,
        )  # fmt: skip
        wanted = np.full(self.batch, -1.0) if grip is None else np.nan_to_num(grip, nan=-1.0)
        if self.scene.grip is not None:
            share = 0.5 * (1.0 - np.clip(wanted, -1.0, 1.0))
            self._grip[:, 0] = share * self.scene.grip.open_m
        if self.scene.cups is not None:
            self._suck(self.scene.cups, wanted > 0.0)
        alone = np.zeros(self.batch, bool)
        if out_of_reach is not None and self._parts:
            alone = out_of_reach
        self._roll(~alone, workers)
        self._roll(alone, None)
        self._check_health()
        return self._trace.copy()

    def touched_at(self, q: JointAngles) -> str | None:
        """Return the name of what still stands or lies in the way of the robot at angles q (N,)
        [rad], its own other parts included; None: nothing. Loose objects are as in the MJCF."""
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
        """(B, n) everything that changes; `set_state` brings it back bit for bit."""
        return self._sims.state.copy()

    def set_state(self, state: Floats) -> None:
        """Continue from a state that `get_state` gave (same scene and batch)."""
        check_shape("state", np.shape(state), self._sims.state.shape, "batch, state")
        self._sims.state[:] = state
        self._set_capsules(np.arange(self.batch))

    def __getstate__(self) -> tuple[Scene, int, Floats]:
        return self.scene, self.batch, self.get_state()

    def __setstate__(self, saved: tuple[Scene, int, Floats]) -> None:
        scene, batch, state = saved
        self.__init__(scene, batch)
        self.set_state(state)

    def _set_capsules(self, ids: Ints) -> None:
        """Give the workers of environments `ids` the capsules of their bodies."""
        body, geoms = self._body[ids].astype(np.int64), self.scene.worker_capsules
        known = capsule_shapes(self.scene.bodies) if self._shapes else {}
        for name, shapes in self._shapes.items():
            shapes[ids[:, None, None], geoms] = known[name][body]

    def _fit(self, workers: WorkerPath) -> None:
        """Check the path's axes; make the buffers when the number of substeps is new."""
        rows, n_substeps = self.scene.worker_mocap, workers.position_world.shape[1]
        expected = (self.batch, max(n_substeps, 1), *rows.shape[:1])
        meaning = "batch, substeps (at least one), workers"
        check_shape("workers.position_world", workers.position_world.shape[:3], expected, meaning)
        if self._control.shape[1] != n_substeps:
            model = self.scene.model
            self._control = np.zeros((self.batch, n_substeps, 2 * self._n))
            self._trace = np.zeros((self.batch, n_substeps, model.nq))

    def _roll(self, which: Bools, workers: WorkerPath | None) -> None:
        """The substeps of some environments (B,), beside workers or (None) with nobody there."""
        n = np.count_nonzero(which)
        if n == 0:
            return
        ids = None if n == len(which) else np.flatnonzero(which)
        rows = slice(None) if ids is None else ids  # all need no copy
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
            self._grip[rows, 0] = load_n(cups, trace["sensordata"]).max(axis=1)
        for alone, beside in shared:
            beside[rows] = alone[rows]

    def _check_health(self) -> None:
        """MuJoCo answers an exploding state or a full memory with a warning: raise it."""
        for sims in (self._sims, self._alone):
            if np.count_nonzero(sims.warning):
                environment, kind, _ = np.argwhere(sims.warning)[0]
                raise HRCError(
                    f"The physics of environment {environment} broke down "
                    f"({mujoco.mjtWarning(int(kind)).name}): expected finite states and bounded "
                    "contacts; reset it, and look at what it was commanded."
                )


def _both(alone: Batch, beside: Batch, field: str) -> tuple[Floats, Floats]:
    """A field of the same environments without workers and with them, whose bodies come last."""
    less, more = alone.bind(field), beside.bind(field)
    return less, more[:, : less.shape[1]] if less.ndim > 1 else more


def no_workers(batch: int, n_substeps: int) -> WorkerPath:
    """The path of nobody, for scenes without workers: arrays (B, T, 0, 22, ...)."""
    lead = (batch, n_substeps, 0, 22)
    return WorkerPath(np.zeros((*lead, 3)), np.zeros((*lead, 4)))


def _servos(scene: Scene) -> Records:
    """(N,) `SERVO` of a scene's arm."""
    servos, config, chain = np.zeros(scene.chain.n_joints, SERVO), scene.config, scene.chain
    servos["low"], servos["high"] = chain.range_rad.T
    servos["fastest"], servos["lead"] = chain.velocity_limit_rad_s, scene.servo_lead_s
    servos["slew"] = slew_rad_s2(scene)
    servos["clamp"] = config.integrator_clamp_rad
    return servos


@kernel
def _substep_commands(q, qd, held, command, wanted, servos, sim_dt, control):
    """Commands of one control step: limited in size, slew and before the joints' ends.

    The rate servo's command runs ahead by its lead: its torque then pays for the acceleration, and
    the holding servo need not lag.

    Args:
        q, qd: (B, N) angles [rad] and velocities [rad/s] now.
        held, command: (B, N) angles that the holding servos hold [rad] and the command in force
            [rad/s], kept near a blocked arm so that it leaves at once; the command is advanced.
        wanted: (B, N) wanted velocities [rad/s]; what is not finite counts as 0.
        servos: (N,) `SERVO`.
        sim_dt: how long a substep is [s].
        control: (B, T, 2 N) written [rad/s]: each substep's mean velocity for the holding servos,
            so that their integral is exact however time is cut; that at its end for the others.
    """
    n_substeps, n = control.shape[1], q.shape[1]
    ctrl_dt = sim_dt * n_substeps
    for b in range(q.shape[0]):
        for i in range(n):
            servo, at = servos[i], q[b, i]
            held[b, i] = min(max(held[b, i], at - servo.clamp), at + servo.clamp)
            most, brake = servo.slew * sim_dt, BRAKE_SHARE * servo.slew
            reach = most * n_substeps
            now = min(max(command[b, i], qd[b, i] - reach), qd[b, i] + reach)
            target = wanted[b, i] if math.isfinite(wanted[b, i]) else 0.0
            target = min(servo.fastest, max(-servo.fastest, target))
            # v ctrl_dt + v^2 / (2 brake) = room: the speed that still stops in time.
            room_up = max(0.0, servo.high - END_MARGIN_RAD - at)
            room_down = max(0.0, at - servo.low - END_MARGIN_RAD)
            fastest_up = brake * (math.sqrt(ctrl_dt**2 + 2 * room_up / brake) - ctrl_dt)
            fastest_down = brake * (math.sqrt(ctrl_dt**2 + 2 * room_down / brake) - ctrl_dt)
            target = min(fastest_up, max(-fastest_down, target))
            for t in range(n_substeps):
                change = min(most, max(-most, target - now))
                # Ramp for |change| / slew, then constant: the mean over the substep.
                control[b, t, i] = now + change * (1.0 - 0.5 * (abs(change) / most))
                now += change
                control[b, t, n + i] = now + servo.lead * change / sim_dt
            command[b, i] = now
