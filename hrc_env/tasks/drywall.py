"""Drywall: the robot presses a board against studs and holds it while a worker drives screws."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from hrc_env.belief import Belief
from hrc_env.core.declared import Records1, dtype_of, make_records
from hrc_env.core.errors import ConfigError, check_fields, require
from hrc_env.core.records import ObjectState
from hrc_env.core.typing import Bools, Floats, Ints, Points3, Rngs, Rotations
from hrc_env.geometry.reach import ReachTarget
from hrc_env.geometry.rotations import matrix
from hrc_env.observations import ObservationTerm
from hrc_env.rewards import RewardTerm, check_kind, progress
from hrc_env.tasks import BUILT_IN
from hrc_env.tasks.partner import find_partner_arms
from hrc_env.tasks.task import Task
from hrc_env.worker.body import assets_dir
from hrc_env.world import FOOT_WORLD, Effects, TaskScene, Weld, WorkerSignal, Workplace, World

BOARD_M = (0.6, 1.2, 0.0125)
"""Edge lengths of the board along its x, y and z axes [m]; z is the normal of its front face."""
BOARD_KG = 6.12
"""Mass of the board [kg], at 680 kg/m^3."""
CUPS_M = (-0.12, -0.15)
"""Position of the suction cups on the board, relative to its centre along its x and y [m]."""
STACK_M = (0.26, -0.98, -0.36)
"""Initial position of the board's centre on the stack, relative to the robot's base [m]; the front
faces up."""
WALL_Y_M = 1.0
"""Position along y of the studs' faces, which face the robot, relative to the robot's base [m]."""
PLACE_M = (0.29, WALL_Y_M - BOARD_M[2] / 2, 0.34)
"""Target position of the board's centre, relative to the robot's base [m]."""
R_PLACE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Target rotation world_from_board: the board stands on a short edge and its front faces the
robot."""
NEAR_STUD_M = 0.56
"""Position along x of the stud for the screws, relative to the robot's base [m]."""
SCREWS_M = tuple((NEAR_STUD_M, z) for z in (0.82, 0.67, 0.52, 0.37))
"""Positions of the screws along x and z, relative to the robot's base [m], from top to bottom."""
AT_PLACE_M = 0.05
"""Distance of the board from its target below which the worker's hands may touch the robot's hand
[m]."""
HAND_NEAR_M = 1.0
"""Distance from the screws within which an estimated hand may touch the robot's hand [m]."""
BESIDE_M = (NEAR_STUD_M + 0.42, WALL_Y_M - 0.50)
"""Position where the worker stands, x and y relative to the robot's base [m]."""
PUSH_N = (20.0, 50.0)
"""Range of the force with which a screwdriver pushes on the board [N]."""
SHEAR = 0.2
"""Force along the board as a fraction of the force of the screwdriver."""
DRIVING_S = 0.6
"""Duration of driving a screw if there is no worker [s]."""
PAUSE_S = 0.6
"""Duration of the pause before each screw if there is no worker [s]."""
MOVED_M = 0.02
"""Largest initial offset of the board on the stack along x and y [m]."""
TURNED_RAD = 0.06
"""Largest initial rotation of the board on the stack [rad]."""
RADIAN_M = 0.3
"""Distance to which a rotation of the board by 1 rad is equivalent in the computation of progress
[m]."""


@dataclass(frozen=True, slots=True)
class DrywallConfig:
    """Tolerances and rewards for holding a board."""

    tolerance_m: float = 0.005
    """Distance of the board's centre from its target below which the board is in position [m]."""
    tolerance_rad: float = 0.0087
    """Rotation of the board from its target below which it is in position [rad]; half a degree by
    default."""
    push_n: tuple[float, float] = PUSH_N
    """Range of the force with which each screw is driven [N]."""
    reward: str = "dense"
    """Kind of reward: "sparse" rewards only screws and completion, "dense" also every metre of
    progress."""
    progress_per_m: float = 5.0
    """Dense reward for every metre by which board and tool approach their targets; a radian of the
    board's rotation counts as 0.3 m."""
    screw_bonus: float = 3.0
    """Reward for each screw that is driven."""
    done_bonus: float = 10.0
    """Reward for a board that is fixed in position and released."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "tolerance_m", "tolerance_rad")
        if not 0.0 <= self.push_n[0] <= self.push_n[1]:
            raise ConfigError(f"DrywallConfig.push_n must be (low, high), got {self.push_n}.")
        check_kind(self)


class DrywallState:
    """State of one environment's board."""

    pose: Annotated[Floats, (7,)]
    """Initial pose of the board: position [m, world] and quaternion (w, x, y, z)."""
    push_n: Annotated[Floats, (len(SCREWS_M),)]
    """Force with which each screw is driven [N]."""
    shear: Annotated[Floats, (len(SCREWS_M), 2)]
    """Force along the board while each screw is driven, along x and z, as fractions of `push_n`."""
    pressed_s: float
    """Time for which the board has been held or fixed in position [s]."""
    driven: int
    """Number of screws that have been driven."""
    boring: bool
    """Whether a screw is being driven."""
    max_offset_m: float
    """Largest distance of the board from its target while screws were driven [m]."""
    max_rotation_rad: float
    """Largest rotation of the board from its target while screws were driven [rad]."""
    spoilt: bool
    """Whether the board was out of position while a screw was driven."""
    done: bool
    """Whether the board is fixed in position and released."""
    left_m: float
    """Sum of the remaining distances of board and tool to their targets [m]."""


class DrywallStep:
    """Results of one control step of one environment."""

    progress_m: float
    """Decrease of the remaining distance [m]."""
    driven: int
    """Number of screws that were driven in this step."""
    done: bool
    """Whether the task was completed in this step."""


DRYWALL = dtype_of(DrywallState)


@dataclass(frozen=True, slots=True)
class DrywallView:
    """Information about the task that is available to the robots."""

    place_world: Points3
    """(3,) target position of the board's centre [m]."""
    driven: Ints
    """(B,) number of screws that have been driven."""


class BoardOffset(NamedTuple):
    """Deviation of boards from their target pose."""

    distance_m: Floats
    """(B,) distance of the board's centre from its target [m]."""
    angle_rad: Floats
    """(B,) angle between the board and its target orientation [rad]."""


class ScrewProgress(NamedTuple):
    """Progress of the screws at the end of a step."""

    driven: Ints
    """(B,) number of screws that have been driven."""
    boring: Bools
    """Mask (B,) of the environments in which a screw is being driven."""


def measure_offset(board: ObjectState) -> BoardOffset:
    """Compute the deviation of boards (B, 1) from their target pose."""
    off_m = np.linalg.norm(board.position_world[:, 0] - (FOOT_WORLD + PLACE_M), axis=-1)
    return BoardOffset(off_m, _measure_turn(matrix(board.quaternion_wxyz[:, 0])))


def _measure_turn(R: Rotations) -> Floats:
    """Compute the angle (B,) between rotations world_from_board (B, 3, 3) and the target [rad]."""
    trace = np.einsum("ij,bij->b", R_PLACE, R)
    return np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0))


def _measure_ways(
    board_world: Points3, R: Rotations, tool_world: Points3, is_taken: Bools
) -> Floats:
    """Compute the remaining distance (B,) of boards and tools to their targets [m].

    Args:
        board_world: (B, 3) centres of the boards [m].
        R: (B, 3, 3) rotations world_from_board.
        tool_world: (B, 3) tool points of the robots [m].
        is_taken: mask (B,) of the boards that the tool has reached.
    """
    away_m = np.linalg.norm(board_world - (FOOT_WORLD + PLACE_M), axis=-1)
    away_m = away_m + RADIAN_M * _measure_turn(R)
    return away_m + np.where(is_taken, 0.0, np.linalg.norm(board_world - tool_world, axis=-1))


def _advance_screws(state: Records1[DrywallState], world: World, dt_s: float) -> ScrewProgress:
    """Return the progress of the screws at the end of a step of dt_s [s].

    The worker drives the screws; without a worker, they are driven automatically while the board is
    pressed against the studs.
    """
    n, driven = len(SCREWS_M), state["driven"]
    workers = require(world.workers, "The state of the workers")
    is_alone = ~workers.present.any(axis=1)
    by_workers = np.maximum(driven, workers.screws.max(axis=1, initial=0))
    since_s = state["pressed_s"] - PAUSE_S * (driven + 1) - DRIVING_S * driven
    boring = is_alone & (driven < n) & (since_s > 0.0) & (state["pressed_s"] > 0.0)
    finished = boring & (since_s >= DRIVING_S - 1e-9)
    return ScrewProgress(
        driven=np.where(is_alone, driven + finished, by_workers),
        boring=np.where(is_alone, boring & ~finished, workers.boring.any(axis=1)),
    )


class Drywall(Task[DrywallConfig, Records1[DrywallState]]):
    """Press a board against studs and hold it while a worker drives four screws."""

    id = "HRCDrywall-v0"
    config_type = DrywallConfig
    observations = (
        ObservationTerm(
            name="place_from_object",
            size=3,
            unit="m",
            frame="world",
            bound=3.0,
            scale=0.5,
            doc="Target of the board's center, relative to its measured position.",
            function=lambda belief: (
                belief.task.place_world - require(belief.objects, "A board").position_world[:, 0]
            ),
        ),
        ObservationTerm(
            name="screws_driven",
            size=1,
            unit="-",
            frame="-",
            bound=4.0,
            scale=2.0,
            doc="Number of driven screws; 4 screws fix the board.",
            function=lambda belief: belief.task.driven.astype(float),
        ),
    )
    rewards = (
        progress(
            "Decrease of the distances from the board to its target, where a radian counts as 0.3 "
            "m, and, until the board is held, from the tool to the board [m]"
        ),
        RewardTerm(
            name="screws",
            doc="`task.screw_bonus` for each screw that is driven in this step.",
            function=lambda belief, step, previous, config: config.screw_bonus * step["driven"],
        ),
        RewardTerm(
            name="done",
            doc="`task.done_bonus` in the step in which the fixed board is released.",
            function=lambda belief, step, previous, config: np.multiply(
                config.done_bonus, step["done"]
            ),
        ),
    )
    achieved = "task/screws_driven"
    failed = "task/screws_remaining"
    starts = (
        "The arm is near home. The board lies on the stack, moved by up to 2 cm and turned by up "
        "to 0.06 rad. The worker waits out of reach until it is pressed against the studs. Without "
        "a worker, the simulation drives the screws automatically."
    )
    ends = (
        "Terminates when four screws hold the board and the suction cups have released it. The "
        "episode is a success if the board's deviation from its target pose stayed below 5 mm and "
        "0.5 degrees while screws were driven."
    )
    max_episode_steps = BUILT_IN[id].max_episode_steps
    robot = "ur10e_cups"
    needs_gripper = True
    defaults: ClassVar = {
        "scene": {"sim_dt": 0.004},
        "motion": {"jobs": "drywall", "near_probability": 1.0, "near_radius_m": (1.7, 2.1)},
    }

    def make_state(self, batch: int) -> Records1[DrywallState]:
        """Return the state of `batch` environments, to be filled by `reset`."""
        return make_records(DrywallState, batch)

    def make_scene(self) -> TaskScene:
        """Return the stack, the board, the studs and the workplace of the worker."""
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
        """Return the position of the suction cups when the board is in position."""
        front = R_PLACE @ [*CUPS_M, BOARD_M[2] / 2]
        return [
            ReachTarget(
                "the target position of the board", FOOT_WORLD + PLACE_M + front, (0.0, 1.0, 0.0)
            )
        ]

    def reset(self, state: Records1[DrywallState], ids: Ints, rngs: Rngs, world: World) -> None:
        """Sample the initial board pose and the screw forces of environments `ids`."""
        state[ids] = np.zeros((), DRYWALL)
        low, high = self.config.push_n
        for b in map(int, ids):
            n, draws = len(SCREWS_M), rngs[b].random(3)
            off = MOVED_M * (2.0 * draws[:2] - 1.0)
            half = 0.5 * (np.pi + TURNED_RAD * (2.0 * draws[2] - 1.0))
            position = FOOT_WORLD + STACK_M + [*off, 0.0]
            state["pose"][b] = (*position, np.cos(half), 0.0, 0.0, np.sin(half))
            state["push_n"][b] = low + (high - low) * rngs[b].random(n)
            direction = 2.0 * np.pi * rngs[b].random(n)
            state["shear"][b] = SHEAR * np.stack([np.cos(direction), np.sin(direction)], axis=1)
        poses, is_taken = state["pose"][ids], np.zeros(len(ids), bool)
        state["left_m"][ids] = _measure_ways(
            poses[:, :3], matrix(poses[:, 3:]), world.robot.tool_world, is_taken
        )

    def object_poses(self, state: Records1[DrywallState], ids: Ints) -> Floats:
        """Return the pose (n, 1, 7) of the board."""
        return state["pose"][ids][:, None]

    def advance(
        self, state: Records1[DrywallState], rngs: Rngs, world: World, dt_s: float
    ) -> Records1[DrywallStep]:
        """Evaluate the board's pose and the screws, and return the results (B,) of the step."""
        board, step = require(world.objects, "A board"), make_records(DrywallStep, len(state))
        off_m, off_rad = measure_offset(board)
        fine = (off_m < self.config.tolerance_m) & (off_rad < self.config.tolerance_rad)
        pressed = fine & (board.held[:, 0] | (state["driven"] == len(SCREWS_M)))
        state["pressed_s"] = np.where(pressed, state["pressed_s"] + dt_s, 0.0)
        driven, boring = _advance_screws(state, world, dt_s)
        step["driven"] = driven - state["driven"]
        state["driven"], state["boring"] = driven, boring
        state["max_offset_m"] = np.where(
            boring, np.maximum(state["max_offset_m"], off_m), state["max_offset_m"]
        )
        state["max_rotation_rad"] = np.where(
            boring, np.maximum(state["max_rotation_rad"], off_rad), state["max_rotation_rad"]
        )
        state["spoilt"] |= boring & ~fine
        done = (driven == len(SCREWS_M)) & ~board.held[:, 0] & fine & ~state["spoilt"]
        step["done"] = done & ~state["done"]
        state["done"] |= done
        left_m = _measure_ways(
            board.position_world[:, 0],
            matrix(board.quaternion_wxyz[:, 0]),
            world.robot.tool_world,
            board.held[:, 0] | (driven > 0),
        )
        step["progress_m"], state["left_m"] = state["left_m"] - left_m, left_m
        return step

    def effects(self, state: Records1[DrywallState]) -> Effects:
        """Return the force on the board while a screw is driven; the last screw fixes the board."""
        screw = np.minimum(state["driven"], len(SCREWS_M) - 1)
        rows = np.arange(len(state))
        push_n = np.where(state["boring"], state["push_n"][rows, screw], 0.0)
        shear = state["shear"][rows, screw]
        force = push_n[:, None] * np.stack([shear[:, 0], np.ones(len(rows)), shear[:, 1]], axis=1)
        x, z = (np.array(SCREWS_M) - np.array(PLACE_M)[[0, 2]]).T
        arm = np.stack([x[screw], np.zeros(len(rows)), z[screw]], axis=1)
        push = np.concatenate([force, np.cross(arm, force)], axis=1)
        return Effects({"board_fixed": state["driven"] == len(SCREWS_M)}, push[:, None])

    def signal(self, state: Records1[DrywallState]) -> WorkerSignal:
        """Return the signal to workers, which may work while the board is in position."""
        return WorkerSignal(
            (state["pressed_s"] > 0.0).astype(int), np.full((len(state), 3), np.nan)
        )

    def is_load(self, state: Records1[DrywallState]) -> Bools:
        """Return a mask (B, 1) of boards that are not yet in position, which are loads."""
        return (state["pressed_s"] == 0.0)[:, None]

    def allowed_contact(self, belief: Belief) -> Bools:
        """Return a mask (B, W, S) of arms near the screws of a board that is held in position."""
        board = require(belief.objects, "A board")
        is_held_there = board.held[:, 0] & (measure_offset(board).distance_m < AT_PLACE_M)
        screws = np.array([(x, WALL_Y_M, z) for x, z in (SCREWS_M[0], SCREWS_M[-1])])
        segments = np.broadcast_to(FOOT_WORLD + screws, (len(is_held_there), 2, 3))
        arms = find_partner_arms(belief.estimate, BESIDE_M, segments, HAND_NEAR_M)
        return arms & is_held_there[:, None, None]

    def is_terminal(self, step: Records1[DrywallStep]) -> Bools:
        """Return a mask (B,) of the environments in which the fixed board was just released."""
        return step["done"]

    def view(self, state: Records1[DrywallState], ids: Ints) -> DrywallView:
        """Return the board's target and the number of driven screws in environments `ids`."""
        return DrywallView(FOOT_WORLD + PLACE_M, state["driven"][ids].copy())

    def info(self, state: Records1[DrywallState]) -> dict[str, Floats]:
        """Return the numbers of screws and the largest deviations of the board, each (B,), by name.

        An episode is a success if the board is fixed in position and released.
        """
        begun = (state["driven"] > 0) | state["boring"]
        return {
            "task/screws_driven": state["driven"].astype(float),
            "task/screws_remaining": len(SCREWS_M) - state["driven"].astype(float),
            "task/max_offset_m": np.where(begun, state["max_offset_m"], np.nan),
            "task/max_rotation_rad": np.where(begun, state["max_rotation_rad"], np.nan),
            "is_success": state["done"].astype(float),
        }

    def markers(self, view: DrywallView) -> Points3:
        """Return the target position (B, 1, 3) of the board's centre [m]."""
        return np.broadcast_to(view.place_world, (len(view.driven), 1, 3))
