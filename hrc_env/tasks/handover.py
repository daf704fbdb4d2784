"""Handover: the robot brings a tool; a worker approaches, extends a hand and takes it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from hrc_env.belief import Belief
from hrc_env.core.declared import Records1, dtype_of, make_records
from hrc_env.core.errors import check_fields, require
from hrc_env.core.records import ObjectState
from hrc_env.core.typing import Bools, Floats, Ints, Points3, Rngs, Velocities3
from hrc_env.geometry.reach import ReachTarget
from hrc_env.geometry.rotations import matrix
from hrc_env.observations import ObservationTerm
from hrc_env.rewards import RewardTerm, check_kind, progress
from hrc_env.tasks import BUILT_IN
from hrc_env.tasks.partner import find_partner_arms
from hrc_env.tasks.task import Task
from hrc_env.worker.body import assets_dir
from hrc_env.world import (
    FOOT_WORLD,
    Effects,
    TaskScene,
    WorkerProgress,
    WorkerSignal,
    Workplace,
    World,
)

BAR_M = (0.03, 0.03, 0.40)
"""Edge lengths of the tool, a bar that stands upright [m]."""
BAR_KG = 0.9
"""Mass of the tool [kg]."""
STAND_M = (0.30, -0.62, -0.10)
"""Initial position of the tool's lower end, relative to the robot's base [m]."""
STAND_UP_M = FOOT_WORLD[2] + STAND_M[2] + BAR_M[2] / 2
"""Initial height of the tool's centre above the floor [m]."""
GRIP_UP_M = -0.08
"""Height of the robot's grip point above the tool's centre [m]."""
HANDLE_UP_M = 0.12
"""Height of the handle, which the worker takes, above the tool's centre [m]."""
BESIDE_M = (1.30, 0.0)
"""Position where the worker stands, x and y relative to the robot's base [m]."""
HAND_UP_M = 0.40
"""Height above the robot's base at which the worker extends a hand [m]."""
MEET_M = (0.78, 0.0, 0.40)
"""Position near which the worker extends a hand, relative to the robot's base [m]."""
HAND_NEAR_M = 0.7
"""Distance from the handle within which an estimated hand may touch the robot's hand [m]."""
OFFERED_M = 0.25
"""Distance between the handle and an extended hand below which the tool is offered and no longer
counts as part of the robot [m]."""
CLOSES_M = 0.02
"""Distance from the handle below which a hand can grasp it [m]."""
CLOSES_M_S = 0.15
"""Speed relative to the handle below which a hand can grasp it [m/s]."""
CLOSES_S = 0.4
"""Time for which distance and speed must be within their limits before the hand grasps the tool
[s]."""
STIFFNESS_N_M = 100.0
"""Stiffness of the worker's hand that holds the tool, modelled as a spring [N/m]."""
DAMPING_NS_M = 12.0
"""Damping of the worker's hand that holds the tool [Ns/m]. The value is stable at 25 Hz."""
CARRIES_S = 0.4
"""Time over which the hand takes over the weight of the tool [s]."""
TWIST_NMS = np.array([0.03, 0.03, 0.001])
"""Rotational damping of the hand about the tool's x, y and z axes [Nms]."""
LIFTED_M = 0.04
"""Height above its stand beyond which the tool counts as lifted, and the worker approaches [m]."""
APART_M = 0.14
"""Distance of the robot's fingers from their grip point beyond which they have left the tool [m].
The worker's hand has lost the tool at twice this distance from the handle."""
APART_S = 0.3
"""Time after the fingers have left the tool until it counts as handed over [s]."""
GRAVITY_M_S2 = 9.81
"""Acceleration of gravity [m/s^2]."""


@dataclass(frozen=True, slots=True)
class HandoverConfig:
    """Force limit and rewards for a handover."""

    gentle_n: float = 60.0
    """Maximum force on the worker's hand in a successful handover [N]."""
    reward: str = "dense"
    """Kind of reward: "sparse" rewards only taking and completion, "dense" also every metre of
    progress."""
    progress_per_m: float = 5.0
    """Dense reward for every metre by which the fingers approach the tool, and the tool approaches
    the position where the worker extends a hand."""
    taken_bonus: float = 5.0
    """Reward when the worker takes the tool."""
    done_bonus: float = 10.0
    """Reward when the handover is complete: the robot has released and left the tool."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "gentle_n")
        check_kind(self)


class HandoverState:
    """State of one environment's handover."""

    pose: Annotated[Floats, (7,)]
    """Initial pose of the tool: position [m, world] and quaternion (w, x, y, z)."""
    handle_world: Annotated[Points3, (3,)]
    """Position of the handle [m]."""
    lifted: bool
    """Whether the robot holds the tool above its stand."""
    offered: bool
    """Whether an extended hand is near the handle."""
    near_s: float
    """Time for which a hand has been ready to grasp the handle [s]."""
    taken: bool
    """Whether a worker has taken the tool."""
    taken_s: float
    """Time since a worker has taken the tool [s]."""
    by: int
    """Index of the worker that has taken the tool."""
    push: Annotated[Floats, (6,)]
    """Force [N] and torque [Nm] of the hand at the tool's centre, in the world frame."""
    max_hand_force_n: float
    """Maximum force on the hand in this episode [N]."""
    away_s: float
    """Time since the fingers have left the tool [s]."""
    dropped: bool
    """Whether the tool has fallen, or the worker's hand has lost it."""
    done: bool
    """Whether the tool has been handed over."""
    left_m: float
    """Sum of the remaining distances of fingers and tool to their targets [m]."""


class HandoverStep:
    """Results of one control step of one environment."""

    progress_m: float
    """Decrease of the remaining distance [m]."""
    taken: bool
    """Whether the worker took the tool in this step."""
    done: bool
    """Whether the task was completed in this step."""


HANDOVER = dtype_of(HandoverState)


@dataclass(frozen=True, slots=True)
class HandoverView:
    """Information about the task that is available to the robots."""

    meet_world: Points3
    """(3,) position near which the worker extends a hand [m]."""
    taken: Bools
    """Mask (B,) of the tools that the worker has taken, which the robot can sense."""


class Handle(NamedTuple):
    """Position and velocity of the tools' handles."""

    position_world: Points3
    """(B, 3) position of each handle [m]."""
    velocity_world: Velocities3
    """(B, 3) velocity of each handle [m/s]."""


def _find_handle(tool: ObjectState) -> Handle:
    """Return the positions and velocities of the handles of tools (B, 1)."""
    R, up = matrix(tool.quaternion_wxyz[:, 0]), np.array([0.0, 0.0, HANDLE_UP_M])
    turning = np.cross(tool.spin_object[:, 0], up)
    velocity = tool.velocity_world[:, 0] + (R @ turning[..., None])[..., 0]
    return Handle(tool.position_world[:, 0] + R @ up, velocity)


def _close_hands(
    state: Records1[HandoverState], workers: WorkerProgress, handle: Handle, dt_s: float
) -> None:
    """Let a hand grasp the tool if it has been at the handle for `CLOSES_S`.

    Args:
        state: (B,) state, in which `offered`, `near_s`, `by` and `taken` are written.
        workers: progress of the workers, with their extended hands.
        handle: handles of the tools.
        dt_s: duration of the step [s].
    """
    if not workers.takes.shape[1]:
        return
    gap_m = np.linalg.norm(workers.grip_world - handle.position_world[:, None], axis=-1)
    state["offered"] = (workers.takes & (gap_m < OFFERED_M)).any(1)
    relative = workers.grip_velocity_world - handle.velocity_world[:, None]
    relative_m_s = np.linalg.norm(relative, axis=-1)
    ready = workers.takes & (gap_m < CLOSES_M) & (relative_m_s < CLOSES_M_S)
    near = ready.any(1) & ~state["taken"]
    state["near_s"] = np.where(near, state["near_s"] + dt_s, 0.0)
    closes = near & (state["near_s"] >= CLOSES_S - 1e-9)
    state["by"] = np.where(closes, np.argmax(ready, axis=1), state["by"])
    state["taken"] |= closes


def _pull_tools(
    state: Records1[HandoverState],
    workers: WorkerProgress,
    tool: ObjectState,
    handle: Handle,
    dt_s: float,
) -> None:
    """Compute the forces of hands that have taken a tool, modelled as damped springs.

    Args:
        state: (B,) state, in which `push`, `taken_s`, `max_hand_force_n` and `dropped` are written.
        workers: progress of the workers, with positions and velocities of their hands.
        tool: (B, 1) states of the tools.
        handle: handles of the tools.
        dt_s: duration of the step [s].
    """
    state["push"] = 0.0
    if not state["taken"].any():
        return
    rows, by = np.arange(len(state)), state["by"]
    grip, grip_velocity = workers.grip_world[rows, by], workers.grip_velocity_world[rows, by]
    state["taken_s"] += np.where(state["taken"], dt_s, 0.0)
    carried = np.minimum(state["taken_s"] / CARRIES_S, 1.0)
    stretch = grip - handle.position_world
    force = STIFFNESS_N_M * stretch + DAMPING_NS_M * (grip_velocity - handle.velocity_world)
    force[:, 2] += carried * BAR_KG * GRAVITY_M_S2
    R = matrix(tool.quaternion_wxyz[:, 0])
    arm = handle.position_world - tool.position_world[:, 0]
    twist = (R @ (TWIST_NMS * tool.spin_object[:, 0])[..., None])[..., 0]
    torque = np.cross(arm, force) - twist
    push = np.where(state["taken"][:, None], np.concatenate([force, torque], axis=1), 0.0)
    state["push"] = push
    force_n = np.linalg.norm(push[:, :3], axis=1)
    state["max_hand_force_n"] = np.maximum(state["max_hand_force_n"], force_n)
    lost = state["taken"] & (np.linalg.norm(stretch, axis=-1) > 2 * APART_M)
    state["dropped"] |= lost


def _measure_ways(
    tool_middle: Points3, handle: Points3, tool_world: Points3, held: Bools, taken: Bools
) -> Floats:
    """Compute the remaining distance (B,) of the fingers to the tool and the handle to the hand.

    Args:
        tool_middle: (B, 3) centres of the tools [m].
        handle: (B, 3) positions of the handles [m].
        tool_world: (B, 3) tool points of the robots [m].
        held: mask (B,) of the tools that the robot holds; for these, the distance of the fingers is
            0.
        taken: mask (B,) of the tools that the worker has taken; for these, the remaining distance
            is 0.
    """
    to_tool_m = _measure_fingers_gap(tool_world, tool_middle)
    to_hand_m = np.linalg.norm(handle - (FOOT_WORLD + MEET_M), axis=-1)
    return np.where(taken, 0.0, to_hand_m + np.where(held, 0.0, to_tool_m))


def _measure_fingers_gap(tool_world: Points3, tool_middle: Points3) -> Floats:
    """Return the distance (B,) of tool points from the grip points of tools [m]."""
    return np.linalg.norm(tool_middle + np.array([0.0, 0.0, GRIP_UP_M]) - tool_world, axis=-1)


class Handover(Task[HandoverConfig, Records1[HandoverState]]):
    """Bring a tool to a worker that extends a hand and takes it, with a limited force."""

    id = "HRCHandover-v0"
    config_type = HandoverConfig
    observations = (
        ObservationTerm(
            name="meeting_from_tool",
            size=3,
            unit="m",
            frame="world",
            bound=3.0,
            scale=0.5,
            doc="Point near which the worker holds out a hand, relative to the tool point.",
            function=lambda belief: belief.task.meet_world - belief.robot.tool_world,
        ),
        ObservationTerm(
            name="object_taken",
            size=1,
            unit="-",
            frame="-",
            bound=1.0,
            scale=1.0,
            doc="1 if the worker has the tool, else 0.",
            function=lambda belief: belief.task.taken.astype(float),
        ),
    )
    rewards = (
        progress(
            "Decrease of the distances from the fingers to the tool, and from its handle to the "
            "point near which the worker holds out a hand [m]"
        ),
        RewardTerm(
            name="taken",
            doc="`task.taken_bonus` in the step in which the worker takes the tool.",
            function=lambda belief, step, previous, config: np.multiply(
                config.taken_bonus, step["taken"]
            ),
        ),
        RewardTerm(
            name="done",
            doc="`task.done_bonus` in the step in which the handover is complete.",
            function=lambda belief, step, previous, config: np.multiply(
                config.done_bonus, step["done"]
            ),
        ),
    )
    achieved = "task/handed_over"
    failed = "task/not_handed_over"
    starts = (
        "The arm is near home, the fingers open. The tool stands upright in its stand. The worker "
        "waits out of reach and approaches when the robot has lifted the tool."
    )
    ends = (
        "Terminates when the worker has the tool and the robot has released it and moved away. The "
        "episode is a success if the force on the hand never exceeded `task.gentle_n`."
    )
    max_episode_steps = BUILT_IN[id].max_episode_steps
    robot = "ur10e_gripper"
    needs_gripper = True
    defaults: ClassVar = {
        "scene": {"sim_dt": 0.004},
        "motion": {"jobs": "handover", "near_probability": 1.0, "near_radius_m": (1.7, 2.1)},
    }

    def make_state(self, batch: int) -> Records1[HandoverState]:
        """Return the state of `batch` environments, to be filled by `reset`."""
        return make_records(HandoverState, batch)

    def make_scene(self) -> TaskScene:
        """Return the stand, the tool and the workplace of the worker."""
        place = Workplace("meeting", "task", BESIDE_M, np.pi, HAND_UP_M)
        mjcf = Path(assets_dir() / "tasks" / "handover.xml").read_text()
        return TaskScene(mjcf, (), (place,))

    def reach_targets(self) -> list[ReachTarget]:
        """Return the position at which the robot meets the worker."""
        return [ReachTarget("the handover position", FOOT_WORLD + MEET_M)]

    def reset(self, state: Records1[HandoverState], ids: Ints, rngs: Rngs, world: World) -> None:
        """Sample the initial pose of the tool in its stand, for environments `ids`."""
        state[ids] = np.zeros((), HANDOVER)
        for b in map(int, ids):
            half = 0.5 * 0.05 * (2.0 * rngs[b].random() - 1.0)
            position = FOOT_WORLD + STAND_M + [0.0, 0.0, BAR_M[2] / 2]
            state["pose"][b] = (*position, np.cos(half), 0.0, 0.0, np.sin(half))
        middle = state["pose"][ids, :3]
        handle = middle + np.array([0.0, 0.0, HANDLE_UP_M])
        state["handle_world"][ids] = handle
        none = np.zeros(len(ids), bool)
        state["left_m"][ids] = _measure_ways(middle, handle, world.robot.tool_world, none, none)

    def object_poses(self, state: Records1[HandoverState], ids: Ints) -> Floats:
        """Return the pose (n, 1, 7) of the tool."""
        return state["pose"][ids][:, None]

    def advance(
        self, state: Records1[HandoverState], rngs: Rngs, world: World, dt_s: float
    ) -> Records1[HandoverStep]:
        """Update tool and hand, let the hand grasp, and return the results (B,) of the step."""
        tool, step = require(world.objects, "A tool"), make_records(HandoverStep, len(state))
        workers = require(world.workers, "The state of the workers")
        held, middle, handle = tool.held[:, 0], tool.position_world[:, 0], _find_handle(tool)
        state["handle_world"] = handle.position_world
        state["lifted"] = held & (middle[:, 2] > STAND_UP_M + LIFTED_M)
        before = state["taken"].copy()
        _close_hands(state, workers, handle, dt_s)
        _pull_tools(state, workers, tool, handle, dt_s)
        away_m = _measure_fingers_gap(world.robot.tool_world, middle)
        away = state["taken"] & ~held & (away_m > APART_M)
        state["away_s"] = np.where(away, state["away_s"] + dt_s, 0.0)
        state["dropped"] |= middle[:, 2] < STAND_UP_M - 0.3
        gentle = state["max_hand_force_n"] <= self.config.gentle_n
        done = (state["away_s"] >= APART_S) & ~state["dropped"] & gentle
        step["taken"], step["done"] = state["taken"] & ~before, done & ~state["done"]
        state["done"] |= done
        left_m = _measure_ways(
            middle, handle.position_world, world.robot.tool_world, held, state["taken"]
        )
        step["progress_m"], state["left_m"] = state["left_m"] - left_m, left_m
        return step

    def effects(self, state: Records1[HandoverState]) -> Effects:
        """Return the force of the worker's hand on the tool."""
        return Effects({}, state["push"][:, None].copy())

    def signal(self, state: Records1[HandoverState]) -> WorkerSignal:
        """Return the signal to workers, with the positions at which they may take lifted tools."""
        stage = np.where(state["taken"], 2, np.where(state["lifted"], 1, 0))
        return WorkerSignal(
            stage, np.where(state["lifted"][:, None], state["handle_world"], np.nan)
        )

    def is_load(self, state: Records1[HandoverState]) -> Bools:
        """Return a mask (B, 1) of tools that have not been offered, which are loads."""
        return ~(state["offered"] | state["taken"])[:, None]

    def allowed_contact(self, belief: Belief) -> Bools:
        """Return a mask (B, W, S) of arms near the handle of a tool that the gripper has lifted."""
        tool = require(belief.objects, "A tool")
        middle, handle = tool.position_world[:, 0], _find_handle(tool).position_world
        away_m = _measure_fingers_gap(belief.robot.tool_world, middle)
        is_brought = (away_m < APART_M) & (middle[:, 2] > STAND_UP_M + LIFTED_M)
        ends = np.stack([handle, handle], axis=1)
        arms = find_partner_arms(belief.estimate, BESIDE_M, ends, HAND_NEAR_M)
        return arms & is_brought[:, None, None]

    def is_terminal(self, step: Records1[HandoverStep]) -> Bools:
        """Return a mask (B,) of the environments in which the tool was handed over in this step."""
        return step["done"]

    def view(self, state: Records1[HandoverState], ids: Ints) -> HandoverView:
        """Return meeting position and mask of taken tools for environments `ids`."""
        return HandoverView(FOOT_WORLD + MEET_M, state["taken"][ids].copy())

    def info(self, state: Records1[HandoverState]) -> dict[str, Floats]:
        """Return whether the tool was handed over or dropped, and the maximum force (B,) by name.

        An episode is a success if the worker has the tool, the robot has released and left it, and
        the force on the hand has never exceeded `gentle_n`.
        """
        return {
            "task/handed_over": state["done"].astype(float),
            "task/not_handed_over": 1.0 - state["done"],
            "task/dropped": state["dropped"].astype(float),
            "task/max_hand_force_n": np.where(state["taken"], state["max_hand_force_n"], np.nan),
            "is_success": state["done"].astype(float),
        }

    def markers(self, view: HandoverView) -> Points3:
        """Return the position (B, 1, 3) at which the robot meets the worker [m]."""
        return np.broadcast_to(view.meet_world, (len(view.taken), 1, 3))
