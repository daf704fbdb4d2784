"""Handover: the robot brings a tool to a worker, who comes, puts out a hand and takes it."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from hrc_env.belief import Belief
from hrc_env.core.errors import check_fields, needed
from hrc_env.core.records import ObjectState
from hrc_env.core.typing import Bools, Floats, Ints, Points3, Records, Rngs
from hrc_env.geometry.reach import ReachTarget
from hrc_env.geometry.rotations import matrix
from hrc_env.observations import ObservationTerm
from hrc_env.rewards import RewardTerm, check_kind, progress
from hrc_env.tasks import BUILT_IN
from hrc_env.tasks.partner import partners_arms
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

BAR_M, BAR_KG = (0.03, 0.03, 0.40), 0.9
"""Edges of the tool, a bar that stands upright, and its mass [kg]."""
STAND_M = (0.30, -0.62, -0.10)
"""Where its lower end stands at first, from the robot's foot [m]."""
STAND_UP_M = FOOT_WORLD[2] + STAND_M[2] + BAR_M[2] / 2
"""How high its middle is then, in the world [m]."""
GRIP_UP_M, HANDLE_UP_M = -0.08, 0.12
"""Where the robot is to grip it, and where the worker does, above its middle [m]."""
BESIDE_M, HAND_UP_M, MEET_M = (1.30, 0.0), 0.40, (0.78, 0.0, 0.40)
"""Where the worker stands, how high a hand is put out, and about where, from the foot [m]."""
NEAR_M = 0.7
"""Whose estimated hand is so near to the handle may take it: shields let it come [m]."""
OFFERED_M = 0.25
"""A handle so near to a hand that is put out is offered: the tool is then no part of the robot."""
CLOSES_M, CLOSES_M_S, CLOSES_S = 0.02, 0.15, 0.4
"""A hand closes on the handle when it has been so near, so calm, for so long."""
STIFFNESS_N_M, DAMPING_NS_M, CARRIES_S = 100.0, 12.0, 0.4
TWIST_NMS = np.array([0.03, 0.03, 0.001])
"""How the hand holds it: as a spring with damping, that of turns about the tool's own axes apart,
and takes its weight over within so long; stable at 25 Hz."""
LIFTED_M, APART_M, APART_S = 0.04, 0.14, 0.3
"""The worker comes when it is lifted so far; it is handed over when fingers have been so far from
it for so long; the hand loses it from there on, too."""
GRAVITY_M_S2 = 9.81


@dataclass(frozen=True, slots=True)
class HandoverConfig:
    """What is gentle, and what a handover is worth."""

    gentle_n: float = 60.0
    """A success needs that the hand never felt more than this [N]."""
    reward: str = "dense"
    """"dense": coming nearer counts, too; "sparse": only taking and the end."""
    progress_per_m: float = 5.0
    """Dense reward for every metre that the fingers come nearer to the tool, and the tool to where
    the worker puts out a hand."""
    taken_bonus: float = 5.0
    """Reward when the worker takes the tool."""
    done_bonus: float = 10.0
    """Reward when it is handed over, let go and left."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "gentle_n")
        check_kind(self)


HANDOVER = np.dtype(
    [
        ("pose", "f8", (7,)),  # where the tool stands at first, world [m]
        ("handle_world", "f8", (3,)),  # [m]
        ("lifted", "?"),  # whether the robot holds it above its stand
        ("offered", "?"),  # whether a hand that is put out is near its handle
        ("near_s", "f8"),  # for how long one has been at it
        ("taken", "?"), ("taken_s", "f8"),  # whether a worker has it; since when
        ("by", "i8"),  # who
        ("push", "f8", (6,)),  # what the hand does to it [N, Nm]
        ("largest_n", "f8"),  # that the hand felt so far
        ("away_s", "f8"),  # for how long the fingers have been away from it
        ("dropped", "?"), ("done", "?"),
        ("left_m", "f8"),  # of the ways
    ],
    align=True,
)  # fmt: skip
"""The task of one environment."""
HANDOVER_STEP = np.dtype([("progress_m", "f8"), ("taken", "?"), ("done", "?")], align=True)
"""Metres that were gained in a step, whether it was taken, whether it was finished in it."""


@dataclass(frozen=True, slots=True)
class HandoverView:
    """The robots' view of their task."""

    meet_world: Points3
    """(3,) about where a hand is put out [m]."""
    taken: Bools
    """(B,) whether the worker has the tool, which the robot feels."""


def _handle(tool: ObjectState) -> tuple[Points3, Floats]:
    """(B, 3) where the handle is [m] and how fast [m/s]."""
    R, up = matrix(tool.quaternion_wxyz[:, 0]), np.array([0.0, 0.0, HANDLE_UP_M])
    turning = np.cross(tool.spin_object[:, 0], up)
    speed = tool.velocity_world[:, 0] + (R @ turning[..., None])[..., 0]
    return tool.position_world[:, 0] + R @ up, speed


def _close(
    state: Records, deeds: WorkerProgress, handle: Points3, speed: Floats, dt_s: float
) -> None:
    """Let a hand close that has been at the handle for a while."""
    if not deeds.takes.shape[1]:
        return
    gap_m = np.linalg.norm(deeds.grip_world - handle[:, None], axis=-1)
    state["offered"] = (deeds.takes & (gap_m < OFFERED_M)).any(1)
    apart_m_s = np.linalg.norm(deeds.grip_velocity_world - speed[:, None], axis=-1)
    ready = deeds.takes & (gap_m < CLOSES_M) & (apart_m_s < CLOSES_M_S)
    near = ready.any(1) & ~state["taken"]
    state["near_s"] = np.where(near, state["near_s"] + dt_s, 0.0)
    closes = near & (state["near_s"] >= CLOSES_S - 1e-9)
    state["by"] = np.where(closes, np.argmax(ready, axis=1), state["by"])
    state["taken"] |= closes


def _pull(
    state: Records,
    deeds: WorkerProgress,
    tool: ObjectState,
    handle: Points3,
    speed: Floats,
    dt_s: float,
) -> None:
    """What the hand that has the tool does to it: a spring with damping to where it grips."""
    state["push"] = 0.0
    if not state["taken"].any():
        return
    rows, by = np.arange(len(state)), state["by"]
    grip, moves = deeds.grip_world[rows, by], deeds.grip_velocity_world[rows, by]
    state["taken_s"] += np.where(state["taken"], dt_s, 0.0)
    carried = np.minimum(state["taken_s"] / CARRIES_S, 1.0)
    force = STIFFNESS_N_M * (grip - handle) + DAMPING_NS_M * (moves - speed)
    force[:, 2] += carried * BAR_KG * GRAVITY_M_S2
    R = matrix(tool.quaternion_wxyz[:, 0])
    arm = handle - tool.position_world[:, 0]
    twist = (R @ (TWIST_NMS * tool.spin_object[:, 0])[..., None])[..., 0]
    torque = np.cross(arm, force) - twist
    push = np.where(state["taken"][:, None], np.concatenate([force, torque], axis=1), 0.0)
    state["push"] = push
    felt_n = np.linalg.norm(push[:, :3], axis=1)
    state["largest_n"] = np.maximum(state["largest_n"], felt_n)
    lost = state["taken"] & (np.linalg.norm(grip - handle, axis=-1) > 2 * APART_M)
    state["dropped"] |= lost


def _left_m(at: Points3, handle: Points3, tool_world: Points3, held: Bools, taken: Bools) -> Floats:
    """(B,) metres that the fingers to the tool, and its handle to the hand, have before them."""
    to_tool_m = _fingers_away_m(tool_world, at)
    to_hand_m = np.linalg.norm(handle - (FOOT_WORLD + MEET_M), axis=-1)
    return np.where(taken, 0.0, to_hand_m + np.where(held, 0.0, to_tool_m))


def _fingers_away_m(tool_world: Points3, at: Points3) -> Floats:
    """(B,) from where a tool is to be gripped whose middle is there."""
    return np.linalg.norm(at + np.array([0.0, 0.0, GRIP_UP_M]) - tool_world, axis=-1)


class Handover(Task[HandoverConfig, Records]):
    """Bring a tool to a worker, who puts out a hand and takes it; be gentle."""

    id = "HRCHandover-v0"
    config_type = HandoverConfig
    observations = (
        ObservationTerm(
            "meeting_from_tool", 3, "m", "world", 3.0, 0.5,
            "From the tool point to about where a hand is put out.",
            lambda now: now.task.meet_world - now.robot.tool_world,
        ),
        ObservationTerm(
            "object_taken", 1, "-", "-", 1.0, 1.0,
            "1 when the worker has the tool.",
            lambda now: now.task.taken.astype(float),
        ),
    )  # fmt: skip
    rewards = (
        progress(
            "Metres that the fingers came nearer to the tool, and its handle to about where a "
            "hand is put out"
        ),
        RewardTerm(
            "taken",
            "`task.taken_bonus` in the step in which the worker takes the tool.",
            lambda now, step, previous, config: np.multiply(config.taken_bonus, step["taken"]),
        ),
        RewardTerm(
            "done",
            "`task.done_bonus` in the step in which it is handed over.",
            lambda now, step, previous, config: np.multiply(config.done_bonus, step["done"]),
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

    def make_state(self, batch: int) -> Records:
        return np.zeros(batch, HANDOVER)

    def make_scene(self) -> TaskScene:
        """Stand and tool, and where the worker stands."""
        place = Workplace("meeting", "task", BESIDE_M, np.pi, HAND_UP_M)
        mjcf = Path(assets_dir() / "tasks" / "handover.xml").read_text()
        return TaskScene(mjcf, (), (place,))

    def reach_targets(self) -> list[ReachTarget]:
        return [ReachTarget("the place to meet", FOOT_WORLD + MEET_M)]

    def reset(self, state: Records, ids: Ints, rngs: Rngs, world: World) -> None:
        """Stand the tool of environments `ids` up anew."""
        state[ids] = np.zeros((), HANDOVER)
        for b in ids.tolist():
            half = 0.5 * 0.05 * (2.0 * rngs[b].random() - 1.0)
            at = FOOT_WORLD + STAND_M + [0.0, 0.0, BAR_M[2] / 2]
            state["pose"][b] = (*at, np.cos(half), 0.0, 0.0, np.sin(half))
        at = state["pose"][ids, :3]
        handle = at + np.array([0.0, 0.0, HANDLE_UP_M])
        state["handle_world"][ids] = handle
        none = np.zeros(len(ids), bool)
        state["left_m"][ids] = _left_m(at, handle, world.robot.tool_world, none, none)

    def object_poses(self, state: Records, ids: Ints) -> Floats:
        return state["pose"][ids][:, None]

    def advance(self, state: Records, rngs: Rngs, world: World, dt_s: float) -> Records:
        """Judge where tool and hand are, and let the hand close; (B,) of `HANDOVER_STEP`."""
        tool, step = needed(world.objects, "A tool"), np.zeros(len(state), HANDOVER_STEP)
        held, at = tool.held[:, 0], tool.position_world[:, 0]
        handle, speed = _handle(tool)
        state["handle_world"] = handle
        state["lifted"] = held & (at[:, 2] > STAND_UP_M + LIFTED_M)
        before = state["taken"].copy()
        _close(state, needed(world.workers, "What workers do"), handle, speed, dt_s)
        _pull(state, needed(world.workers, "What workers do"), tool, handle, speed, dt_s)
        away_m = _fingers_away_m(world.robot.tool_world, at)
        away = state["taken"] & ~held & (away_m > APART_M)
        state["away_s"] = np.where(away, state["away_s"] + dt_s, 0.0)
        state["dropped"] |= at[:, 2] < STAND_UP_M - 0.3
        gentle = state["largest_n"] <= self.config.gentle_n
        done = (state["away_s"] >= APART_S) & ~state["dropped"] & gentle
        step["taken"], step["done"] = state["taken"] & ~before, done & ~state["done"]
        state["done"] |= done
        left_m = _left_m(at, handle, world.robot.tool_world, held, state["taken"])
        step["progress_m"], state["left_m"] = state["left_m"] - left_m, left_m
        return step

    def effects(self, state: Records) -> Effects:
        return Effects({}, state["push"][:, None].copy())

    def signal(self, state: Records) -> WorkerSignal:
        """The worker comes when the tool is lifted, and goes on when it is theirs."""
        stage = np.where(state["taken"], 2, np.where(state["lifted"], 1, 0))
        return WorkerSignal(
            stage, np.where(state["lifted"][:, None], state["handle_world"], np.nan)
        )

    def is_load(self, state: Records) -> Bools:
        return ~(state["offered"] | state["taken"])[:, None]

    def allowed_contact(self, belief: Belief) -> Bools:
        """Return the arms whose hands are near the handle while the robot brings the tool."""
        tool = needed(belief.objects, "A tool")
        at, handle = tool.position_world[:, 0], _handle(tool)[0]
        away_m = _fingers_away_m(belief.robot.tool_world, at)
        brought = (away_m < APART_M) & (at[:, 2] > STAND_UP_M + LIFTED_M)
        ends = np.stack([handle, handle], axis=1)
        return partners_arms(belief.estimate, BESIDE_M, ends, NEAR_M) & brought[:, None, None]

    def is_terminal(self, step: Records) -> Bools:
        return step["done"]

    def view(self, state: Records, ids: Ints) -> HandoverView:
        return HandoverView(FOOT_WORLD + MEET_M, state["taken"][ids].copy())

    def info(self, state: Records) -> dict[str, Floats]:
        """Return whether the tool was handed over or dropped and the largest force, (B,) each.

        It is a success if the worker has the tool, the robot has let go and left, and the force on
        the hand never exceeded `gentle_n`.
        """
        return {
            "task/handed_over": state["done"].astype(float),
            "task/not_handed_over": 1.0 - state["done"],
            "task/dropped": state["dropped"].astype(float),
            "task/largest_n": np.where(state["taken"], state["largest_n"], np.nan),
            "is_success": state["done"].astype(float),
        }

    def markers(self, view: HandoverView) -> Points3:
        return np.broadcast_to(view.meet_world, (len(view.taken), 1, 3))
