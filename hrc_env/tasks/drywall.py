"""Drywall: the robot presses a board against studs and holds it while a worker drives screws."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from hrc_env.belief import Belief
from hrc_env.core.errors import ConfigError, check_fields, needed
from hrc_env.core.records import ObjectState
from hrc_env.core.typing import Bools, Floats, Ints, Points3, Records, Rngs, Rotations
from hrc_env.geometry.reach import ReachTarget
from hrc_env.geometry.rotations import matrix
from hrc_env.observations import ObservationTerm
from hrc_env.rewards import RewardTerm, check_kind, progress
from hrc_env.tasks import BUILT_IN
from hrc_env.tasks.partner import partners_arms
from hrc_env.tasks.task import Task
from hrc_env.worker.body import assets_dir
from hrc_env.world import FOOT_WORLD, Effects, TaskScene, Weld, WorkerSignal, Workplace, World

BOARD_M, BOARD_KG = (0.6, 1.2, 0.0125), 6.12
"""Edges of the board along its x, y and z, which is the normal of its front [m]; 680 kg/m^3."""
CUPS_M = (-0.12, -0.15)
"""Where cups sit on it, along its x and y from its middle: away from where people work [m]."""
STACK_M = (0.26, -0.98, -0.36)
"""Where its middle lies on the stack at first, front up, from the robot's foot [m]."""
WALL_Y_M = 1.0
"""Where the studs' faces are, which look to the robot's right [m]."""
PLACE_M = (0.29, WALL_Y_M - BOARD_M[2] / 2, 0.34)
"""Where its middle belongs."""
R_PLACE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""world_from_board there: it stands on a short edge, its front to the robot."""
NEAR_STUD_M = 0.56
"""The stud along which screws go [m along x]."""
SCREWS_M = tuple((NEAR_STUD_M, z) for z in (0.82, 0.67, 0.52, 0.37))
"""Where they go, the uppermost first: along x, and above the foot [m]."""
THERE_M, NEAR_M = 0.05, 1.0
"""While the board is held so near to its place, shields let people's hands come who are so near to
where screws go [m]."""
BESIDE_M = (NEAR_STUD_M + 0.42, WALL_Y_M - 0.50)
"""Where the worker stands, who looks at the board askew."""
PUSH_N, SHEAR = (20.0, 50.0), 0.2
"""A screwdriver pushes with so much, and aside with this share of it."""
ALONE_S, PAUSE_S = 0.6, 0.6
"""Where there is no worker, screws are driven by themselves: for so long, so long after another."""
MOVED_M, TURNED_RAD = 0.02, 0.06
"""At first the board lies off its place on the stack by up to so much."""


@dataclass(frozen=True, slots=True)
class DrywallConfig:
    """What counts as held, and what that is worth."""

    tolerance_m: float = 0.005
    """The board is in its place when its middle is nearer to it than this [m],"""
    tolerance_rad: float = 0.0087
    """turned by less than this, half a degree [rad]; for as long as screws are driven."""
    push_n: tuple[float, float] = PUSH_N
    """Range of the force with which each screw is driven [N]."""
    reward: str = "dense"
    """"dense": coming nearer counts, too; "sparse": only screws and the end."""
    progress_per_m: float = 5.0
    """Dense reward for every metre that board and tool come nearer to where they go; a radian of
    the board's turn counts as 0.3 m."""
    screw_bonus: float = 3.0
    """Reward for each screw that is driven while the board is in its place."""
    done_bonus: float = 10.0
    """Reward for a board that is fixed in its place and let go."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "tolerance_m", "tolerance_rad")
        if not 0.0 <= self.push_n[0] <= self.push_n[1]:
            raise ConfigError(f"DrywallConfig.push_n must be (low, high), got {self.push_n}.")
        check_kind(self)


DRYWALL = np.dtype(
    [
        ("pose", "f8", (7,)),  # where the board lies at first, world [m]
        ("push_n", "f8", (len(SCREWS_M),)),  # with which each screw is driven
        ("shear", "f8", (len(SCREWS_M), 2)),  # aside, shares of that along x and z
        ("pressed_s", "f8"),  # for how long it has been in its place, held
        ("driven", "i8"),  # screws
        ("boring", "?"),  # whether one is being driven
        ("worst_m", "f8"), ("worst_rad", "f8"),  # farthest off its place meanwhile
        ("spoilt", "?"),  # whether that was too far
        ("done", "?"),  # fixed in its place, let go
        ("left_m", "f8"),  # of the ways
    ],
    align=True,
)  # fmt: skip
"""The task of one environment."""
DRYWALL_STEP = np.dtype([("progress_m", "f8"), ("driven", "i8"), ("done", "?")], align=True)
"""Metres that were gained in a step, screws that were driven, whether it was finished."""


@dataclass(frozen=True, slots=True)
class DrywallView:
    """The robots' view of their task."""

    place_world: Points3
    """(3,) where the board's middle belongs [m]."""
    driven: Ints
    """(B,) screws."""


def off_place(board: ObjectState) -> tuple[Floats, Floats]:
    """(B,) how far the board is from its place [m], and turned against it [rad]."""
    off_m = np.linalg.norm(board.position_world[:, 0] - (FOOT_WORLD + PLACE_M), axis=-1)
    return off_m, _turned_rad(matrix(board.quaternion_wxyz[:, 0]))


def _turned_rad(R: Rotations) -> Floats:
    trace = np.einsum("ij,bij->b", R_PLACE, R)
    return np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0))


def _left_m(at: Points3, R: Rotations, tool_world: Points3, taken: Bools) -> Floats:
    """(B,) metres that the board, and the tool to it until it has it, have before them."""
    away_m = np.linalg.norm(at - (FOOT_WORLD + PLACE_M), axis=-1) + 0.3 * _turned_rad(R)
    return away_m + np.where(taken, 0.0, np.linalg.norm(at - tool_world, axis=-1))


def _screwed(state: Records, world: World, dt_s: float) -> tuple[Ints, Bools]:
    """(B,) screws that are driven, and whether one is being driven: by the worker, or, where nobody
    is, by themselves while the board is pressed."""
    n, driven = len(SCREWS_M), state["driven"]
    deeds = needed(world.workers, "What workers do")
    alone = ~deeds.present.any(axis=1)
    theirs = np.maximum(driven, deeds.screws.max(axis=1, initial=0))
    since_s = state["pressed_s"] - PAUSE_S * (driven + 1) - ALONE_S * driven
    boring = alone & (driven < n) & (since_s > 0.0) & (state["pressed_s"] > 0.0)
    finished = boring & (since_s >= ALONE_S - 1e-9)
    driven, boring = np.where(alone, driven + finished, theirs), boring & ~finished
    return driven, np.where(alone, boring, deeds.boring.any(axis=1))


class Drywall(Task[DrywallConfig, Records]):
    """Press a board against studs and hold it while a worker drives four screws."""

    id = "HRCDrywall-v0"
    config_type = DrywallConfig
    observations = (
        ObservationTerm(
            "place_from_object", 3, "m", "world", 3.0, 0.5,
            "From the board's middle, as measured, to where it belongs.",
            lambda now: now.task.place_world - needed(now.objects, "A board").position_world[:, 0],
        ),
        ObservationTerm(
            "screws_driven", 1, "-", "-", 4.0, 2.0,
            "How many screws are driven; 4: the board is fixed.",
            lambda now: now.task.driven.astype(float),
        ),
    )  # fmt: skip
    rewards = (
        progress(
            "Metres that the board came nearer to its place, 0.3 m for a radian, and the tool to "
            "it until it is held"
        ),
        RewardTerm(
            "screws",
            "`task.screw_bonus` for each screw that is driven.",
            lambda now, step, previous, config: config.screw_bonus * step["driven"],
        ),
        RewardTerm(
            "done",
            "`task.done_bonus` in the step in which the fixed board is let go.",
            lambda now, step, previous, config: np.multiply(config.done_bonus, step["done"]),
        ),
    )
    achieved = "task/screws_driven"
    failed = "task/screws_left"
    starts = (
        "The arm is near home. The board lies on the stack, moved by up to 2 cm and turned by up "
        "to 0.06 rad. The worker waits out of reach until it is pressed to the studs; without a "
        "worker screws are driven by themselves."
    )
    ends = (
        "When four screws hold the board and the cups have let go. A success: while screws were "
        "driven it was never off its place by 5 mm or half a degree."
    )
    max_episode_steps = BUILT_IN[id].max_episode_steps
    robot = "ur10e_cups"
    needs_gripper = True
    defaults: ClassVar = {
        "scene": {"sim_dt": 0.004},
        "motion": {"jobs": "drywall", "near_probability": 1.0, "near_radius_m": (1.7, 2.1)},
    }

    def make_state(self, batch: int) -> Records:
        return np.zeros(batch, DRYWALL)

    def make_scene(self) -> TaskScene:
        """Stack, board, studs, and where the worker stands who drives the screws."""
        place = Workplace("board", "task", BESIDE_M, 0.75 * np.pi, SCREWS_M[0][1])
        return TaskScene(
            Path(assets_dir() / "tasks" / "drywall.xml").read_text(),
            (
                Weld("cups_board", ("task/board_cups", "robot/tool_point")),
                Weld("board_fixed", ("task/board_middle", "task/place")),
            ),
            (place,),
        )

    def reach_targets(self) -> list[ReachTarget]:
        """Where the cups are when the board is in its place."""
        front = R_PLACE @ [*CUPS_M, BOARD_M[2] / 2]
        return [ReachTarget("the board's place", FOOT_WORLD + PLACE_M + front, (0.0, 1.0, 0.0))]

    def reset(self, state: Records, ids: Ints, rngs: Rngs, world: World) -> None:
        """Lay the board of environments `ids` onto the stack anew."""
        state[ids] = np.zeros((), DRYWALL)
        low, high = self.config.push_n
        for b in ids.tolist():
            n, draws = len(SCREWS_M), rngs[b].random(3)
            off = MOVED_M * (2.0 * draws[:2] - 1.0)
            half = 0.5 * (np.pi + TURNED_RAD * (2.0 * draws[2] - 1.0))
            at = FOOT_WORLD + STACK_M + [*off, 0.0]
            state["pose"][b] = (*at, np.cos(half), 0.0, 0.0, np.sin(half))
            state["push_n"][b] = low + (high - low) * rngs[b].random(n)
            way = 2.0 * np.pi * rngs[b].random(n)
            state["shear"][b] = SHEAR * np.stack([np.cos(way), np.sin(way)], axis=1)
        poses_ = state["pose"][ids]
        state["left_m"][ids] = _left_m(
            poses_[:, :3], matrix(poses_[:, 3:]), world.robot.tool_world, np.zeros(len(ids), bool)
        )

    def object_poses(self, state: Records, ids: Ints) -> Floats:
        return state["pose"][ids][:, None]

    def advance(self, state: Records, rngs: Rngs, world: World, dt_s: float) -> Records:
        """Judge where the board is and what was screwed; (B,) of `DRYWALL_STEP`."""
        board, step = needed(world.objects, "A board"), np.zeros(len(state), DRYWALL_STEP)
        off_m, off_rad = off_place(board)
        fine = (off_m < self.config.tolerance_m) & (off_rad < self.config.tolerance_rad)
        pressed = fine & (board.held[:, 0] | (state["driven"] == len(SCREWS_M)))
        state["pressed_s"] = np.where(pressed, state["pressed_s"] + dt_s, 0.0)
        driven, boring = _screwed(state, world, dt_s)
        step["driven"] = driven - state["driven"]
        state["driven"], state["boring"] = driven, boring
        state["worst_m"] = np.where(boring, np.maximum(state["worst_m"], off_m), state["worst_m"])
        state["worst_rad"] = np.where(
            boring, np.maximum(state["worst_rad"], off_rad), state["worst_rad"]
        )
        state["spoilt"] |= boring & ~fine
        done = (driven == len(SCREWS_M)) & ~board.held[:, 0] & fine & ~state["spoilt"]
        step["done"] = done & ~state["done"]
        state["done"] |= done
        at, R = board.position_world[:, 0], matrix(board.quaternion_wxyz[:, 0])
        left_m = _left_m(at, R, world.robot.tool_world, board.held[:, 0] | (driven > 0))
        step["progress_m"], state["left_m"] = state["left_m"] - left_m, left_m
        return step

    def effects(self, state: Records) -> Effects:
        """A screw that is being driven pushes the board; four hold it."""
        which = np.minimum(state["driven"], len(SCREWS_M) - 1)
        rows = np.arange(len(state))
        push_n = np.where(state["boring"], state["push_n"][rows, which], 0.0)
        aside = state["shear"][rows, which]
        force = push_n[:, None] * np.stack([aside[:, 0], np.ones(len(rows)), aside[:, 1]], axis=1)
        x, z = (np.array(SCREWS_M) - np.array(PLACE_M)[[0, 2]]).T
        arm = np.stack([x[which], np.zeros(len(rows)), z[which]], axis=1)
        push = np.concatenate([force, np.cross(arm, force)], axis=1)
        return Effects({"board_fixed": state["driven"] == len(SCREWS_M)}, push[:, None])

    def signal(self, state: Records) -> WorkerSignal:
        return WorkerSignal(
            (state["pressed_s"] > 0.0).astype(int), np.full((len(state), 3), np.nan)
        )

    def is_load(self, state: Records) -> Bools:
        return (state["pressed_s"] == 0.0)[:, None]

    def allowed_contact(self, belief: Belief) -> Bools:
        """Return the arms whose hands are near the screws while the board is held there."""
        board = needed(belief.objects, "A board")
        there = board.held[:, 0] & (off_place(board)[0] < THERE_M)
        line = np.array([(x, WALL_Y_M, z) for x, z in (SCREWS_M[0], SCREWS_M[-1])])
        lines = np.broadcast_to(FOOT_WORLD + line, (len(there), 2, 3))
        return partners_arms(belief.estimate, BESIDE_M, lines, NEAR_M) & there[:, None, None]

    def is_terminal(self, step: Records) -> Bools:
        return step["done"]

    def view(self, state: Records, ids: Ints) -> DrywallView:
        return DrywallView(FOOT_WORLD + PLACE_M, state["driven"][ids].copy())

    def info(self, state: Records) -> dict[str, Floats]:
        """Return counts of screws and how far off the board was while they were driven, (B,) each.

        It is a success if the board is fixed in its place and let go.
        """
        begun = (state["driven"] > 0) | state["boring"]
        return {
            "task/screws_driven": state["driven"].astype(float),
            "task/screws_left": len(SCREWS_M) - state["driven"].astype(float),
            "task/worst_m": np.where(begun, state["worst_m"], np.nan),
            "task/worst_rad": np.where(begun, state["worst_rad"], np.nan),
            "is_success": state["done"].astype(float),
        }

    def markers(self, view: DrywallView) -> Points3:
        return np.broadcast_to(view.place_world, (len(view.driven), 1, 3))
