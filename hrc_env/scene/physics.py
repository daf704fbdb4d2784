"""Many copies of one scene, stepped together: the arm obeys, the workers walk.

One `mujoco.batch.Batch` for every batch size, the single environment too. Everything that
changes lives in the batch's state rows, so that copying them copies the simulation, and
results do not depend on neighbours; threads are a matter of `shards`.
"""

import math

import mujoco
import numpy as np
from mujoco.batch import Batch

from hrc_env.core.errors import ConfigError, HRCError, check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.records import WorkerPath
from hrc_env.core.typing import Bools, Floats, Ints, JointAngles, JointVelocities
from hrc_env.scene.build import Scene, without_workers
from hrc_env.scene.worker import CAPSULE_FIELDS, capsule_shapes

INPUTS = int(
    mujoco.mjtState.mjSTATE_CTRL
    | mujoco.mjtState.mjSTATE_MOCAP_POS
    | mujoco.mjtState.mjSTATE_MOCAP_QUAT
)
"""What a substep is given: servo commands, then places, then turns of the workers' bodies."""
COMMANDS = int(mujoco.mjtState.mjSTATE_CTRL)
"""The same without workers."""
OF_THE_ARM = ("time", "qpos", "qvel", "act", "qacc_warmstart")
"""What of an environment's state the arm's motion hangs on, and changes."""


END_MARGIN_RAD = 0.02
"""Where the arm comes to rest before the end of a joint's range."""
BRAKE_SHARE = 0.7
"""Share of the slew limit that stopping before an end counts on."""


class Physics:
    """B simulations of a scene."""

    def __init__(self, scene: Scene, batch: int) -> None:
        if batch < 1:
            raise ConfigError(f"Physics needs at least one environment, got {batch}.")
        rows = scene.worker_mocap
        if not np.array_equal(rows.ravel(), np.arange(scene.model.nmocap)):
            raise HRCError(
                "The workers' segments must be the scene's only mocap bodies, in order; "
                f"expected rows 0 to {scene.model.nmocap - 1}, got {rows.ravel()}."
            )
        self.scene = scene
        self.batch = batch
        self._n = scene.chain.n_joints
        self._sims = Batch(scene.model, nsim=batch, nthread=1)
        self._alone = Batch(without_workers(scene).model, nsim=batch, nthread=1)
        self._shared = [(self._alone.bind(f), self._sims.bind(f)) for f in OF_THE_ARM]
        self._qpos, self._qvel = self._sims.bind("qpos"), self._sims.bind("qvel")
        self._act, kept = self._sims.bind("act"), self._sims.bind("userdata")
        self._command, self._body = kept[:, : self._n], kept[:, self._n :]
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

    def reset(self, ids: Ints, q: JointAngles, body: Ints | None = None) -> None:
        """Put environments `ids` (sorted) to rest at angles q (len(ids), N) [rad].

        Their workers have bodies (len(ids), W) of the scene's; None: the first.
        """
        ids = np.asarray(ids, int)
        check_shape("q", np.shape(q), (len(ids), self._n), "one row per id, one angle per joint")
        for sims in (self._sims, self._alone):
            sims.reset(ids, stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        self._qpos[ids, : self._n] = q
        self._act[ids, : self._n] = q
        self._body[ids] = 0 if body is None else body
        self._set_capsules(ids)

    def step(
        self, qd_command: JointVelocities, workers: WorkerPath, out_of_reach: Bools | None = None
    ) -> JointAngles:
        """One control step of every environment.

        An arm that no worker can touch moves as it would alone, bit for bit, and is quicker so.

        Args:
            qd_command: (B, N) wanted joint velocities [rad/s]; limited in size and slew, and
                braked before the joints' ends, here.
            workers: after every substep, arrays (B, T, W, S, ...); T is the number of substeps.
                W = 0 in a scene without workers.
            out_of_reach: (B,) where no worker can touch the arm in this step; None: nowhere.

        Returns:
            (B, T, N) the arm's angles after every substep [rad].

        Raises:
            ConfigError: wrong shapes. HRCError: the physics broke down, with the reason.
        """
        check_shape("qd_command", np.shape(qd_command), (self.batch, self._n), "batch, joints")
        self._fit(workers)
        n = self._n
        substep_commands(
            self.scene, self._qpos[:, :n], self._qvel[:, :n], self._act[:, :n], self._command,
            np.asarray(qd_command, float), hold=self._control[:, :, :n],
            rate=self._control[:, :, n : 2 * n],
        )  # fmt: skip
        alone = np.zeros(self.batch, bool) if out_of_reach is None else out_of_reach
        self._roll_beside(~alone, workers)
        self._roll_alone(alone)
        self._check_health()
        return self._trace[:, :, :n].copy()

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
            self._control = np.zeros((self.batch, n_substeps, model.nu))
            self._trace = np.zeros((self.batch, n_substeps, model.nq))

    def _roll_beside(self, which: Bools, workers: WorkerPath) -> None:
        """The substeps of some environments (B,), beside workers."""
        rows, ids = _chosen(which)
        if ids is not None and len(ids) == 0:
            return
        places, turns = workers.position_world[rows], workers.quaternion_wxyz[rows]
        lead = (*places.shape[:2], -1)
        parts = (self._control[rows], places.reshape(lead), turns.reshape(lead))
        control = np.concatenate(parts, axis=2)
        self._trace[rows] = self._sims.rollout(lead[1], control, INPUTS, ("qpos",), ids)["qpos"]

    def _roll_alone(self, which: Bools) -> None:
        """The substeps of some environments (B,), with nobody there."""
        rows, ids = _chosen(which)
        if ids is not None and len(ids) == 0:
            return
        for alone, beside in self._shared:
            alone[rows] = beside[rows]
        control = self._control[rows]
        trace = self._alone.rollout(control.shape[1], control, COMMANDS, ("qpos",), ids)
        self._trace[rows] = trace["qpos"]
        for alone, beside in self._shared:
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


def _chosen(which: Bools) -> tuple[slice | Ints, Ints | None]:
    """Rows of some environments (B,), and their numbers as MuJoCo has them; all need no copy."""
    if np.count_nonzero(which) == len(which):
        return slice(None), None
    ids = np.flatnonzero(which)
    return ids, ids


def no_workers(batch: int, n_substeps: int) -> WorkerPath:
    """The path of nobody, for scenes without workers: arrays (B, T, 0, 22, ...)."""
    lead = (batch, n_substeps, 0, 22)
    return WorkerPath(np.zeros((*lead, 3)), np.zeros((*lead, 4)))


def substep_commands(
    scene: Scene,
    q: JointAngles,
    qd: JointVelocities,
    held: JointAngles,
    command: JointVelocities,
    wanted: JointVelocities,
    hold: Floats,
    rate: Floats,
) -> None:
    """Commands of one control step: limited in size, slew and before the joints' ends.

    The rate servo's command runs ahead by `scene.servo_lead_s`: its torque then pays for the
    acceleration, and the holding servo need not lag.

    Args:
        scene: for its settings, ranges and velocity limits.
        q, qd: (B, N) angles [rad] and velocities [rad/s] now.
        held: (B, N) angles that the holding servos hold [rad]; kept near a blocked arm, as are the
            commands, so that it leaves at once.
        command: (B, N) the command in force; at the end of the step on return [rad/s].
        wanted: (B, N) wanted velocities [rad/s]; what is not finite counts as 0.
        hold: (B, T, N) written: mean velocity in each substep, so that the holding servo's
            integral is exact however time is cut [rad/s].
        rate: (B, T, N) written: velocity at the end of each substep, with the lead [rad/s].
    """
    config, chain = scene.config, scene.chain
    slew, sim_dt = config.slew_rad_s2, config.sim_dt
    reach = slew * sim_dt * rate.shape[1]
    _clamp_integrators(q, qd, held, command, config.integrator_clamp_rad, reach)
    ranges, limits = chain.range_rad, chain.velocity_limit_rad_s
    _ramp(q, command, wanted, ranges, limits, slew, sim_dt, scene.servo_lead_s, hold, rate)


@kernel
def _clamp_integrators(q, qd, held, command, clamp, reach):
    for b in range(q.shape[0]):
        for i in range(q.shape[1]):
            held[b, i] = min(max(held[b, i], q[b, i] - clamp), q[b, i] + clamp)
            command[b, i] = min(max(command[b, i], qd[b, i] - reach), qd[b, i] + reach)


@kernel
def _ramp(q, command, wanted, ranges, limits, slew, sim_dt, lead_s, hold, rate):
    brake, ctrl_dt = BRAKE_SHARE * slew, sim_dt * rate.shape[1]
    for b in range(q.shape[0]):
        for i in range(q.shape[1]):
            target = wanted[b, i]
            if not math.isfinite(target):
                target = 0.0
            target = min(limits[i], max(-limits[i], target))
            # v ctrl_dt + v^2 / (2 brake) = room: the speed that still stops in time.
            room_up = max(0.0, ranges[i, 1] - END_MARGIN_RAD - q[b, i])
            room_down = max(0.0, q[b, i] - ranges[i, 0] - END_MARGIN_RAD)
            fastest_up = brake * (math.sqrt(ctrl_dt**2 + 2 * room_up / brake) - ctrl_dt)
            fastest_down = brake * (math.sqrt(ctrl_dt**2 + 2 * room_down / brake) - ctrl_dt)
            target = min(fastest_up, max(-fastest_down, target))
            now = command[b, i]
            for t in range(rate.shape[1]):
                change = min(slew * sim_dt, max(-slew * sim_dt, target - now))
                # Ramp for |change| / slew, then constant: the mean over the substep.
                ramped = abs(change) / (slew * sim_dt)
                hold[b, t, i] = now + change * (1.0 - 0.5 * ramped)
                now += change
                rate[b, t, i] = now + lead_s[i] * change / sim_dt
            command[b, i] = now
