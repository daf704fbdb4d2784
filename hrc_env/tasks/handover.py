"""Handover: the robot brings a tool to a worker that comes, puts out a hand and takes it."""

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
"""Edges of the tool, a bar that stands upright [m]."""
BAR_KG = 0.9
"""Mass of the tool [kg]."""
STAND_M = (0.30, -0.62, -0.10)
"""Place of the tool's lower end at the start, from the robot's foot [m]."""
STAND_UP_M = FOOT_WORLD[2] + STAND_M[2] + BAR_M[2] / 2
"""Height of the tool's middle above the floor at the start [m]."""
GRIP_UP_M = -0.08
"""Height of the robot's grip above the tool's middle [m]."""
HANDLE_UP_M = 0.12
"""Height of the handle, which the worker takes, above the tool's middle [m]."""
BESIDE_M = (1.30, 0.0)
"""Place where the worker stands, x and y from the robot's foot [m]."""
HAND_UP_M = 0.40
"""Height above the foot at which the worker puts out a hand [m]."""
MEET_M = (0.78, 0.0, 0.40)
"""Place near which the worker puts out a hand, from the robot's foot [m]."""
HAND_NEAR_M = 0.7
"""Distance from the handle within which an estimated hand may touch the robot's hand [m]."""
OFFERED_M = 0.25
"""Distance of the handle from a hand that is put out below which the tool is offered: it then no
longer counts as part of the robot [m]."""
CLOSES_M = 0.02
"""Distance from the handle below which a hand can close on it [m]."""
CLOSES_M_S = 0.15
"""Speed relative to the handle below which a hand can close on it [m/s]."""
CLOSES_S = 0.4
"""Time for which both must hold before the hand closes [s]."""
STIFFNESS_N_M = 100.0
"""Stiffness of the hand that holds the tool, as a spring [N/m]."""
DAMPING_NS_M = 12.0
"""Damping of that spring [Ns/m], stable at 25 Hz."""
CARRIES_S = 0.4
"""Time within which the hand takes the tool's weight over [s]."""
TWIST_NMS = np.array([0.03, 0.03, 0.001])
"""Damping of turns about the tool's x, y and z axes by the hand [Nms]."""
LIFTED_M = 0.04
"""Height above its stand from which on the tool is lifted, and the worker comes [m]."""
APART_M = 0.14
"""Distance of the robot's fingers from their grip from which on they have left the tool [m]; at
twice this distance from its handle the worker's hand has lost it."""
APART_S = 0.3
"""Time for which the fingers must have left the tool before it is handed over [s]."""
GRAVITY_M_S2 = 9.81
"""Acceleration of gravity [m/s^2]."""


@dataclass(frozen=True, slots=True)
class HandoverConfig:
    """Limit and rewards of a handover."""

    gentle_n: float = 60.0
    """Greatest force on the worker's hand in a successful handover [N]."""
    reward: str = "dense"
    """"dense" rewards every metre of progress, too; "sparse" only taking and the end."""
    progress_per_m: float = 5.0
    """Dense reward for every metre that the fingers come nearer to the tool, and the tool to the
    place where the worker puts out a hand."""
    taken_bonus: float = 5.0
    """Reward when the worker takes the tool."""
    done_bonus: float = 10.0
    """Reward when the tool is handed over and the robot has let go and left it."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "gentle_n")
        check_kind(self)


class HandoverState:
    """State of one environment's handover."""

    pose: Annotated[Floats, (7,)]
    """Pose of the tool at the start: position [m, world] and quaternion (w, x, y, z)."""
    handle_world: Annotated[Points3, (3,)]
    """Place of the handle [m]."""
    lifted: bool
    """Whether the robot holds the tool above its stand."""
    offered: bool
    """Whether a hand that is put out is near the handle."""
    near_s: float
    """Time for which a hand has been at the handle [s]."""
    taken: bool
    """Whether a worker has taken the tool."""
    taken_s: float
    """Time since then [s]."""
    by: int
    """Index of the worker that has taken it."""
    push: Annotated[Floats, (6,)]
    """Force [N] and torque [Nm] of the hand at the tool's middle, in the world frame."""
    max_hand_force_n: float
    """Greatest force on the hand in this episode [N]."""
    away_s: float
    """Time for which the fingers have left the tool [s]."""
    dropped: bool
    """Whether the tool has fallen, or the hand has lost it."""
    done: bool
    """Whether the tool is handed over."""
    left_m: float
    """Length of the ways that fingers and tool have before them [m]."""


class HandoverStep:
    """Results of one control step of one environment."""

    progress_m: float
    """Length by which the remaining ways became shorter [m]."""
    taken: bool
    """Whether the worker took the tool in this step."""
    done: bool
    """Whether the task was completed in this step."""


HANDOVER = dtype_of(HandoverState)


@dataclass(frozen=True, slots=True)
class HandoverView:
    """Knowledge of the robots about their task."""

    meet_world: Points3
    """(3,) place near which the worker puts out a hand [m]."""
    taken: Bools
    """(B,) whether the worker has the tool, which the robot feels."""


class Handle(NamedTuple):
    """Motion of the tools' handles."""

    position_world: Points3
    """(B, 3) place of each handle [m]."""
    velocity_world: Velocities3
    """(B, 3) velocity of each handle [m/s]."""


def _find_handle(tool: ObjectState) -> Handle:
    """Return place and velocity of the handles of tools (B, 1)."""
    R, up = matrix(tool.quaternion_wxyz[:, 0]), np.array([0.0, 0.0, HANDLE_UP_M])
    turning = np.cross(tool.spin_object[:, 0], up)
    velocity = tool.velocity_world[:, 0] + (R @ turning[..., None])[..., 0]
    return Handle(tool.position_world[:, 0] + R @ up, velocity)


def _close_hands(
    state: Records1[HandoverState], workers: WorkerProgress, handle: Handle, dt_s: float
) -> None:
    """Close a hand that has been at the handle for `CLOSES_S`.

    Args:
        state: (B,) of which `offered`, `near_s`, `by` and `taken` are written.
        workers: the hands that are put out.
        handle: the tools' handles.
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
    """Write the push of hands that have taken a tool: springs with damping to where they grip.

    Args:
        state: (B,) of which `push`, `taken_s`, `max_hand_force_n` and `dropped` are written.
        workers: places and velocities of the hands.
        tool: (B, 1) the tools.
        handle: the tools' handles.
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
    """Return (B,) the length of the ways of the fingers to the tool and of the handle to the hand.

    Args:
        tool_middle: (B, 3) middles of the tools [m].
        handle: (B, 3) places of their handles [m].
        tool_world: (B, 3) tool points of the robots [m].
        held: (B,) whether the robot holds the tool, so that the fingers' way is behind them.
        taken: (B,) whether the worker has taken it, so that no way is left.
    """
    to_tool_m = _measure_fingers_gap(tool_world, tool_middle)
    to_hand_m = np.linalg.norm(handle - (FOOT_WORLD + MEET_M), axis=-1)
    return np.where(taken, 0.0, to_hand_m + np.where(held, 0.0, to_tool_m))


def _measure_fingers_gap(tool_world: Points3, tool_middle: Points3) -> Floats:
    """Return (B,) the distance of tool points from the grips of tools with these middles [m]."""
    return np.linalg.norm(tool_middle + np.array([0.0, 0.0, GRIP_UP_M]) - tool_world, axis=-1)


class Handover(Task[HandoverConfig, Records1[HandoverState]]):
    """Bring a tool to a worker, who puts out a hand and takes it; be gentle."""

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
            doc="From the tool point to the place near which a hand is put out.",
            function=lambda belief: belief.task.meet_world - belief.robot.tool_world,
        ),
        ObservationTerm(
            name="object_taken",
            size=1,
            unit="-",
            frame="-",
            bound=1.0,
            scale=1.0,
            doc="1 when the worker has the tool.",
            function=lambda belief: belief.task.taken.astype(float),
        ),
    )
    rewards = (
        progress(
            "Metres that the fingers came nearer to the tool, and its handle to the place near "
            "which a hand is put out"
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
            doc="`task.done_bonus` in the step in which it is handed over.",
            function=lambda belief, step, previous, config: np.multiply(
                config.done_bonus, step["done"]
            ),
        ),
    )
    achieved = "task/handed_over"
    failed = "task/not_handed_over"
    starts = (
        "The arm is near home, the fingers open. The tool stands upright in its stand. The worker"
        " waits out of reach, and comes when the robot has lifted it."
    )
    ends = (
        "When the worker has the tool, and the robot has let go and left it: that is the success,"
        " if the hand never felt more than `task.gentle_n`."
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
        """Return stand and tool, and the place of the worker."""
        place = Workplace("meeting", "task", BESIDE_M, np.pi, HAND_UP_M)
        mjcf = Path(assets_dir() / "tasks" / "handover.xml").read_text()
        return TaskScene(mjcf, (), (place,))

    def reach_targets(self) -> list[ReachTarget]:
        """Return the place to meet the worker."""
        return [ReachTarget("the place to meet", FOOT_WORLD + MEET_M)]

    def reset(self, state: Records1[HandoverState], ids: Ints, rngs: Rngs, world: World) -> None:
        """Stand the tool of environments `ids` up."""
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
        """Judge tool and hand, let the hand close, and return (B,) the results of the step."""
        tool, step = require(world.objects, "A tool"), make_records(HandoverStep, len(state))
        workers = require(world.workers, "What workers do")
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
        """Return the push of the worker's hand on the tool."""
        return Effects({}, state["push"][:, None].copy())

    def signal(self, state: Records1[HandoverState]) -> WorkerSignal:
        """Return the stages: the worker comes when the tool is lifted, and then takes it."""
        stage = np.where(state["taken"], 2, np.where(state["lifted"], 1, 0))
        return WorkerSignal(
            stage, np.where(state["lifted"][:, None], state["handle_world"], np.nan)
        )

    def is_load(self, state: Records1[HandoverState]) -> Bools:
        """Return (B, 1) whether the held tool counts as part of the robot: until it is offered."""
        return ~(state["offered"] | state["taken"])[:, None]

    def allowed_contact(self, belief: Belief) -> Bools:
        """Return the arms with a hand near the handle while the robot brings the tool."""
        tool = require(belief.objects, "A tool")
        middle, handle = tool.position_world[:, 0], _find_handle(tool).position_world
        away_m = _measure_fingers_gap(belief.robot.tool_world, middle)
        is_brought = (away_m < APART_M) & (middle[:, 2] > STAND_UP_M + LIFTED_M)
        ends = np.stack([handle, handle], axis=1)
        arms = find_partner_arms(belief.estimate, BESIDE_M, ends, HAND_NEAR_M)
        return arms & is_brought[:, None, None]

    def is_terminal(self, step: Records1[HandoverStep]) -> Bools:
        """Return (B,) whether the tool was handed over in this step."""
        return step["done"]

    def view(self, state: Records1[HandoverState], ids: Ints) -> HandoverView:
        """Return the place to meet and whether the worker has the tool, of environments `ids`."""
        return HandoverView(FOOT_WORLD + MEET_M, state["taken"][ids].copy())

    def info(self, state: Records1[HandoverState]) -> dict[str, Floats]:
        """Return whether the tool was handed over or dropped and the largest force, (B,) each.

        An episode is a success if the worker has the tool, the robot has let go and left, and the
        force on the hand never exceeded `gentle_n`.
        """
        return {
            "task/handed_over": state["done"].astype(float),
            "task/not_handed_over": 1.0 - state["done"],
            "task/dropped": state["dropped"].astype(float),
            "task/max_hand_force_n": np.where(state["taken"], state["max_hand_force_n"], np.nan),
            "is_success": state["done"].astype(float),
        }

    def markers(self, view: HandoverView) -> Points3:
        """Return the place (B, 1, 3) to meet the worker [m]."""
        return np.broadcast_to(view.meet_world, (len(view.taken), 1, 3))
