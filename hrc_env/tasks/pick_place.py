"""Pick and place: move pieces of studs from a table to a rack on the other side of the robot."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np

from hrc_env.core.declared import Records1, dtype_of, make_records
from hrc_env.core.errors import check_fields, require
from hrc_env.core.records import ObjectState
from hrc_env.core.typing import Bools, Floats, Ints, Points3, Rngs
from hrc_env.geometry.reach import ReachTarget
from hrc_env.geometry.rotations import matrix
from hrc_env.observations import ObservationTerm
from hrc_env.rewards import RewardTerm, check_kind, progress
from hrc_env.tasks import BUILT_IN
from hrc_env.tasks.task import Task
from hrc_env.worker.body import assets_dir
from hrc_env.world import FOOT_WORLD, TaskScene, Workplace, World

STUDS = 3
"""Number of pieces of studs."""
STUD_M = (0.038, 0.300, 0.089)
"""Edge lengths of a piece along x, y and z when it stands on edge [m]."""
STUD_KG = 0.5
"""Mass of a piece [kg]."""
SURFACE_M = -0.02
"""Height of table and rack above the robot's base [m]."""
ROW_AT_M = (0.34, -0.62)
"""Initial centre of the row of pieces relative to the robot's base, x and y [m]."""
PLACES_M = tuple((x, 0.62, SURFACE_M + STUD_M[2] / 2) for x in (0.24, 0.36, 0.48))
"""Target position of each piece's centre in the rack, relative to the robot's base [m]."""
PLACES_WORLD = FOOT_WORLD + np.array(PLACES_M)
"""(3, 3) target position of each piece's centre in the rack [m, world]."""
STACK = Workplace("stack", "task", (1.025, -0.62), np.pi, SURFACE_M, loads=("stud",) * 4)
"""Workplace where the worker takes pieces from the other end of the table."""
TRESTLE = Workplace("trestle", "bench", (2.10, -1.50), 0.0, SURFACE_M)
"""Workplace where the worker puts down the pieces that were taken from the table."""
ROW_M = 0.12
"""Initial spacing of the pieces in the row [m]."""
ASIDE_M = 0.02
"""Largest initial offset of a piece along y [m]."""
TURN_RAD = 0.2
"""Largest initial rotation of a piece [rad]."""


@dataclass(frozen=True, slots=True)
class PlacedConfig:
    """Criteria for a placed piece, which is at rest in its target pose and released."""

    tolerance_m: float = 0.01
    """Distance of a piece's centre from its target below which the piece is in position [m]."""
    tolerance_rad: float = 0.087
    """Rotation of a piece from its target below which it is in position [rad]; 5 degrees by
    default."""
    resting_m_s: float = 0.02
    """Speed of a piece below which it is at rest [m/s]."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "tolerance_m", "tolerance_rad", "resting_m_s")


@dataclass(frozen=True, slots=True)
class PickPlaceConfig(PlacedConfig):
    """Criteria and rewards for placing pieces."""

    reward: str = "dense"
    """Kind of reward: "sparse" rewards only placed pieces, "dense" also every metre of progress."""
    progress_per_m: float = 5.0
    """Dense reward for every metre by which pieces and tool approach their targets."""
    placed_bonus: float = 10.0
    """Reward for each piece that is placed; subtracted again if the piece leaves its target."""

    def __post_init__(self) -> None:
        PlacedConfig.__post_init__(self)
        check_kind(self)


class PickPlaceState:
    """State of one environment's pieces."""

    poses: Annotated[Floats, (STUDS, 7)]
    """Initial pose of each piece: position [m, world] and quaternion (w, x, y, z)."""
    placed: Annotated[Bools, (STUDS,)]
    """Whether each piece is placed."""
    left_m: float
    """Sum of the remaining distances of pieces and tool to their targets [m]."""
    dropped: bool
    """Whether a piece has fallen below the table."""


class PickPlaceStep:
    """Results of one control step of one environment."""

    progress_m: float
    """Decrease of the remaining distance [m]."""
    placed: int
    """Number of pieces that were placed in this step, minus those that left their targets."""
    done: bool
    """Whether all pieces are placed."""


PICK_PLACE = dtype_of(PickPlaceState)


@dataclass(frozen=True, slots=True)
class PickPlaceView:
    """Information about the task that is available to the robots."""

    placed: Bools
    """Mask (B, 3) of the pieces that are at rest in their target pose and released."""
    places_world: Points3
    """(3, 3) target position of each piece's centre [m, world]."""


def is_in_place(objects: ObjectState, config: PlacedConfig) -> Bools:
    """Return a mask (B, 3) of the pieces that are at rest in their target pose and released."""
    off_m = np.linalg.norm(objects.position_world - PLACES_WORLD, axis=-1)
    R = matrix(objects.quaternion_wxyz)
    least = np.cos(config.tolerance_rad)
    straight = (np.abs(R[..., 1, 1]) > least) & (R[..., 2, 2] > least)
    still = np.linalg.norm(objects.velocity_world, axis=-1) < config.resting_m_s
    return (off_m < config.tolerance_m) & straight & still & ~objects.held


def _measure_ways(studs_world: Points3, tool_world: Points3, placed: Bools) -> Floats:
    """Return the remaining distance (B,) of pieces to targets and of the tool to a piece [m].

    Args:
        studs_world: (B, 3, 3) centres of the pieces [m].
        tool_world: (B, 3) tool points of the robots [m]; their target is the first unplaced piece.
        placed: (B, 3) whether each piece is placed.
    """
    away_m = np.linalg.norm(studs_world - PLACES_WORLD, axis=-1)
    to_tool_m = np.linalg.norm(studs_world - tool_world[:, None], axis=-1)
    first = np.argmin(placed, axis=1)
    reach_m = np.where(placed.all(1), 0.0, to_tool_m[np.arange(len(placed)), first])
    return np.where(placed, 0.0, away_m).sum(1) + reach_m


class PickPlace(Task[PlacedConfig, Records1[PickPlaceState]]):
    """Take pieces of studs from a table that a worker also uses, and place them in a rack."""

    id = "HRCPickPlace-v0"
    config_type = PickPlaceConfig
    observations = (
        ObservationTerm(
            name="place_from_object",
            size=3 * STUDS,
            unit="m",
            frame="world",
            bound=3.0,
            scale=0.5,
            doc="Target position of each piece, relative to its measured position.",
            function=lambda belief: (
                belief.task.places_world - require(belief.objects, "An object").position_world
            ),
        ),
        ObservationTerm(
            name="object_placed",
            size=STUDS,
            unit="-",
            frame="-",
            bound=1.0,
            scale=1.0,
            doc="1 if the piece rests at its target position and is released, else 0.",
            function=lambda belief: belief.task.placed.astype(float),
        ),
    )
    rewards = (
        progress(
            "Decrease of the distances from the pieces to their target positions, and from the "
            "tool to the first piece that is not placed [m]"
        ),
        RewardTerm(
            name="placed",
            doc="`task.placed_bonus` for each piece that is placed in this step, minus the same "
            "for each that left its target position.",
            function=lambda belief, step, previous, config: config.placed_bonus * step["placed"],
        ),
    )
    achieved = "task/studs_placed"
    failed = "task/studs_remaining"
    starts = (
        "The arm is near home, the fingers open. Three pieces stand on edge on the table, each "
        "moved by up to 2 cm and turned by up to 0.2 rad; four more lie beside them, which the "
        "worker takes away one after the other."
    )
    ends = (
        "Terminates when all three pieces rest at their target positions and are released, "
        "which is the success."
    )
    max_episode_steps = BUILT_IN[id].max_episode_steps
    robot = "ur10e_gripper"
    needs_gripper = True
    defaults: ClassVar = {
        "scene": {"sim_dt": 0.004},
        "motion": {"jobs": "stack", "near_probability": 0.2, "near_radius_m": (1.7, 2.1)},
    }

    def make_state(self, batch: int) -> Records1[PickPlaceState]:
        """Return the state of `batch` environments, to be filled by `reset`."""
        return make_records(PickPlaceState, batch)

    def make_scene(self) -> TaskScene:
        """Return the table, the rack, the pieces and the two workplaces of the worker."""
        mjcf = Path(assets_dir() / "tasks" / "pick_place.xml").read_text()
        return TaskScene(mjcf, (), (STACK, TRESTLE))

    def reach_targets(self) -> list[ReachTarget]:
        """Return the target positions of the pieces, which are gripped from above."""
        down = (0.0, 0.0, -1.0)
        return [
            ReachTarget(f"the target position of piece {k + 1}", place, down)
            for k, place in enumerate(PLACES_WORLD)
        ]

    def reset(self, state: Records1[PickPlaceState], ids: Ints, rngs: Rngs, world: World) -> None:
        """Sample the initial poses of the pieces in environments `ids`."""
        state[ids] = np.zeros((), PICK_PLACE)
        x, y = ROW_AT_M
        for b in map(int, ids):
            draws = 2.0 * rngs[b].random((STUDS, 3)) - 1.0
            poses = np.zeros((STUDS, 7))
            poses[:, 0] = x + ROW_M * (np.arange(STUDS) - 1)
            poses[:, 1] = y + ASIDE_M * draws[:, 1]
            poses[:, 2] = SURFACE_M + STUD_M[2] / 2
            poses[:, :3] += FOOT_WORLD
            half = 0.5 * TURN_RAD * draws[:, 2]
            poses[:, 3], poses[:, 6] = np.cos(half), np.sin(half)
            state["poses"][b] = poses
        studs, none = state["poses"][ids, :, :3], np.zeros((len(ids), STUDS), bool)
        state["left_m"][ids] = _measure_ways(studs, world.robot.tool_world, none)

    def object_poses(self, state: Records1[PickPlaceState], ids: Ints) -> Floats:
        """Return the poses (n, 3, 7) of the pieces."""
        return state["poses"][ids]

    def advance(
        self, state: Records1[PickPlaceState], rngs: Rngs, world: World, dt_s: float
    ) -> Records1[PickPlaceStep]:
        """Evaluate the poses of the pieces, and return the results (B,) of the step."""
        objects = require(world.objects, "A loose object")
        step = make_records(PickPlaceStep, len(state))
        placed = is_in_place(objects, self.config)
        left_m = _measure_ways(objects.position_world, world.robot.tool_world, placed)
        step["progress_m"], state["left_m"] = state["left_m"] - left_m, left_m
        step["placed"] = placed.sum(1) - state["placed"].sum(1)
        step["done"] = placed.all(1)
        state["placed"] = placed
        lowest_m = FOOT_WORLD[2] + SURFACE_M
        state["dropped"] |= (objects.position_world[..., 2] < lowest_m).any(1)
        return step

    def is_terminal(self, step: Records1[PickPlaceStep]) -> Bools | bool:
        """Return a mask (B,) of the environments in which all pieces are placed."""
        return step["done"]

    def view(self, state: Records1[PickPlaceState], ids: Ints) -> PickPlaceView:
        """Return the mask of placed pieces in environments `ids`, and all target positions."""
        return PickPlaceView(state["placed"][ids].copy(), PLACES_WORLD)

    def info(self, state: Records1[PickPlaceState]) -> dict[str, Floats]:
        """Return the numbers (B,) of placed and remaining pieces by name.

        An episode is a success if all pieces are placed.
        """
        placed = state["placed"].sum(1).astype(float)
        return {
            "task/studs_placed": placed,
            "task/studs_remaining": STUDS - placed,
            "task/dropped": state["dropped"].astype(float),
            "is_success": (placed == STUDS).astype(float),
        }

    def markers(self, view: PickPlaceView) -> Points3:
        """Return the target positions (B, 3, 3) of the pieces in the rack [m]."""
        return np.broadcast_to(view.places_world, (len(view.placed), STUDS, 3))
