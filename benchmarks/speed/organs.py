"""Timing of the parts of a step, each of which is a set of functions.

The benchmark fails if a function has been renamed or is no longer called. This detects code that
has been moved and would not be timed.
"""

from collections.abc import Mapping, Sequence

from benchmarks.speed.contenders import Contender
from benchmarks.speed.stopwatch import Place, Stopwatch
from hrc_env import infos as step_infos
from hrc_env import observations, rewards, simulation
from hrc_env.core.errors import HRCError
from hrc_env.geometry import chains
from hrc_env.motion import generator
from hrc_env.perception import emulator
from hrc_env.pipeline.tracking import PoseTracking
from hrc_env.safety import incidents
from hrc_env.scene.physics import Physics
from hrc_env.vector import env, infos

RESET, REST, TOTAL = "reset", "rest", "total"
"""Names of further rows of the table: resets, remaining time, and total."""
ORGANS: Mapping[str, Sequence[Place]] = {
    "physics": ((simulation, "joint_command"), (Physics, "step")),
    "motion": (
        (generator, "advance"),
        (generator, "watch"),
        (simulation, "worker_truth"),
        (simulation, "worker_capsules"),
    ),
    "emulator": ((emulator, "emulate"),),
    "tracking": ((PoseTracking, "perceive"),),
    "distances": (
        (chains, "robot_path"),
        (simulation, "estimated_separation"),
        (incidents, "measure_paths"),
        (incidents.IncidentMonitor, "step"),
    ),
    "observation": ((observations, "observe"),),
    "reward": ((rewards, "evaluate_terms"), (rewards, "sum_terms")),
    "info": (
        (step_infos, "tracking_info"),
        (step_infos, "cost_info"),
        (simulation.Simulation, "_episode_info"),
        (simulation.StepResult, "info_of"),
        (env, "make_table"),
        (infos.InfoTable, "arrays"),
    ),
    RESET: ((simulation.Simulation, "reset"),),
}
"""Functions of each part of a step, at level `keypoints` with one worker.

The part `emulator` includes the test of lines of sight, `physics` the controller, `distances` those
between bodies of the robot, `reward` the task, and `tracking` the transport of keypoints to the
estimator.
"""


class Organs:
    """A timer of the parts of a step, which also detects functions that are never called."""

    def __init__(self, organs: Mapping[str, Sequence[Place]] = ORGANS) -> None:
        self.organs = organs
        self._idle: set[str] | None = None

    def us_per_env_step(
        self, contender: Contender, n_episodes: int, n_threads: int
    ) -> dict[str, float]:
        """Measure the times per environment step of parts, resets, remainder, and total [us].

        The time of a part is summed over threads and divided by their number; this is the
        contribution of the part to the wall-clock time.
        """
        watch = Stopwatch(self.organs, whole=(RESET,))
        with watch.running():
            pace = contender.run(n_episodes)
        idle = set(watch.idle)
        self._idle = idle if self._idle is None else self._idle & idle
        us = {organ: 1e6 * s / n_threads / pace.env_steps for organ, s in watch.seconds.items()}
        total = 1e6 * pace.seconds / pace.env_steps
        return {**us, REST: total - sum(us.values()), TOTAL: total}

    def check_all_called(self) -> None:
        """Raise `HRCError` if a function in `ORGANS` has not been called in any run."""
        if self._idle:
            raise HRCError(
                "The table ORGANS contains functions that no step calls, so that their time would "
                f"not be measured: {', '.join(sorted(self._idle))}. Correct ORGANS in "
                "benchmarks/speed/organs.py."
            )
