"""Picking and placing: pieces of studs lie on a table, and belong into a rack on the other side."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from hrc_env.core.errors import check_fields, needed
from hrc_env.core.records import ObjectState
from hrc_env.core.typing import Bools, Floats, Ints, Points3, Records, Rngs
from hrc_env.geometry.reach import ReachTarget
from hrc_env.geometry.rotations import matrix
from hrc_env.observations import ObservationTerm
from hrc_env.rewards import RewardTerm, check_kind, progress
from hrc_env.tasks import BUILT_IN
from hrc_env.tasks.task import Task
from hrc_env.worker.body import assets_dir
from hrc_env.world import FOOT_WORLD, TaskScene, Workplace, World

STUDS = 3
STUD_M, STUD_KG = (0.038, 0.300, 0.089), 0.5
"""Edges of a piece that stands on edge, along its x, y and z [m]; its mass [kg]."""
SURFACE_M = -0.02
"""Height of table and rack above the robot's foot [m]."""
ROW_AT_M = (0.34, -0.62)
PLACES_M = tuple((x, 0.62, SURFACE_M + STUD_M[2] / 2) for x in (0.24, 0.36, 0.48))
"""Middle of the row of pieces, and of each that rests in its place, from the robot's foot [m]."""
STACK = Workplace("stack", "task", (1.025, -0.62), np.pi, SURFACE_M, loads=("stud",) * 4)
TRESTLE = Workplace("trestle", "bench", (2.10, -1.50), 0.0, SURFACE_M)
"""Where the worker stands who takes pieces from the other end of the table, and lays them down."""
ROW_M, ASIDE_M, TURN_RAD = 0.12, 0.02, 0.2
"""Pieces lie in a row so far apart, each moved and turned by up to so much."""


@dataclass(frozen=True, slots=True)
class PlacedConfig:
    """What counts as placed."""

    tolerance_m: float = 0.01
    """A piece is in its place when its middle is nearer to it than this [m],"""
    tolerance_rad: float = 0.087
    """turned by less than this, 5 degrees [rad],"""
    resting_m_s: float = 0.02
    """slower than this [m/s], and let go."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "tolerance_m", "tolerance_rad", "resting_m_s")


@dataclass(frozen=True, slots=True)
class PickPlaceConfig(PlacedConfig):
    """What counts as placed, and what that is worth."""

    reward: str = "dense"
    """"dense": coming nearer counts, too; "sparse": only pieces in their places."""
    progress_per_m: float = 5.0
    """Dense reward for every metre that pieces, and the tool, come nearer to where they go."""
    placed_bonus: float = 10.0
    """Reward for a piece that is placed; taken off again if it leaves its place."""

    def __post_init__(self) -> None:
        PlacedConfig.__post_init__(self)
        check_kind(self)


PICK_PLACE = np.dtype(
    [
        ("poses", "f8", (STUDS, 7)),  # where pieces lie at first, world [m]
        ("placed", "?", (STUDS,)),  # which are in their places now
        ("left_m", "f8"),  # of the ways [m]
        ("dropped", "?"),  # whether one lies below the table
    ],
    align=True,
)
"""The task of one environment."""
PICK_PLACE_STEP = np.dtype([("progress_m", "f8"), ("placed", "i8"), ("done", "?")], align=True)
"""Metres that were gained in a step, pieces that were placed (less those that left), the end."""


@dataclass(frozen=True, slots=True)
class PickPlaceView:
    """The robots' view of their task."""

    placed: Bools
    """(B, 3)."""
    places_world: Points3
    """(3, 3) [m]."""


def places_world() -> Points3:
    """(3, 3) where the middles of placed pieces are [m]."""
    return FOOT_WORLD + np.array(PLACES_M)


def in_place(objects: ObjectState, config: PlacedConfig) -> Bools:
    """(B, 3) which pieces rest in their places, let go."""
    off_m = np.linalg.norm(objects.position_world - places_world(), axis=-1)
    R = matrix(objects.quaternion_wxyz)
    least = np.cos(config.tolerance_rad)
    straight = (np.abs(R[..., 1, 1]) > least) & (R[..., 2, 2] > least)
    still = np.linalg.norm(objects.velocity_world, axis=-1) < config.resting_m_s
    return (off_m < config.tolerance_m) & straight & still & ~objects.held


def _left_m(studs_world: Points3, tool_world: Points3, placed: Bools) -> Floats:
    """(B,) metres that the pieces which are not placed, and the tool to the first of them, have
    before them."""
    away_m = np.linalg.norm(studs_world - places_world(), axis=-1)
    to_tool_m = np.linalg.norm(studs_world - tool_world[:, None], axis=-1)
    first = np.argmin(placed, axis=1)
    reach_m = np.where(placed.all(1), 0.0, to_tool_m[np.arange(len(placed)), first])
    return np.where(placed, 0.0, away_m).sum(1) + reach_m


class PickPlace(Task[PlacedConfig, Records]):
    """Take pieces of studs from a table and lay them into a rack, while a worker takes from the
    same table.
    """

    id = "HRCPickPlace-v0"
    config_type = PickPlaceConfig
    observations = (
        ObservationTerm(
            "place_from_object", 3 * STUDS, "m", "world", 3.0, 0.5,
            "From each piece, as measured, to its place.",
            lambda now: now.task.places_world - needed(now.objects, "An object").position_world,
        ),
        ObservationTerm(
            "object_placed", STUDS, "-", "-", 1.0, 1.0,
            "1 for a piece that rests in its place, let go.",
            lambda now: now.task.placed.astype(float),
        ),
    )  # fmt: skip
    rewards = (
        progress(
            "Metres that pieces came nearer to their places, and the tool to the first that is "
            "not placed"
        ),
        RewardTerm(
            "placed",
            "`task.placed_bonus` for each piece that is placed in this step, less those that left.",
            lambda now, step, previous, config: config.placed_bonus * step["placed"],
        ),
    )
    achieved = "task/studs_placed"
    failed = "task/studs_left"
    starts = (
        "The arm is near home, the fingers open. Three pieces stand on edge on the table, each "
        "moved by up to 2 cm and turned by up to 0.2 rad; four more lie beside them, of which the"
        " worker takes one after the other away."
    )
    ends = "When all three pieces rest in their places, let go: that is the success."
    max_episode_steps = BUILT_IN[id].max_episode_steps
    robot = "ur10e_gripper"
    needs_gripper = True
    defaults: ClassVar = {
        "scene": {"sim_dt": 0.004},
        "motion": {"jobs": "stack", "near_probability": 0.2, "near_radius_m": (1.7, 2.1)},
    }

    def make_state(self, batch: int) -> Records:
        return np.zeros(batch, PICK_PLACE)

    def make_scene(self) -> TaskScene:
        """Table, rack and pieces, and where the worker takes from the same table."""
        mjcf = Path(assets_dir() / "tasks" / "pick_place.xml").read_text()
        return TaskScene(mjcf, (), (STACK, TRESTLE))

    def reach_targets(self) -> list[ReachTarget]:
        """Where pieces go; they are gripped from above."""
        down = (0.0, 0.0, -1.0)
        return [
            ReachTarget(f"the place of piece {k + 1}", at, down)
            for k, at in enumerate(places_world())
        ]

    def reset(self, state: Records, ids: Ints, rngs: Rngs, world: World) -> None:
        """Lay the pieces of environments `ids` out anew."""
        state[ids] = np.zeros((), PICK_PLACE)
        x, y = ROW_AT_M
        for b in ids.tolist():
            draws = 2.0 * rngs[b].random((STUDS, 3)) - 1.0
            at = np.zeros((STUDS, 7))
            at[:, 0] = x + ROW_M * (np.arange(STUDS) - 1)
            at[:, 1] = y + ASIDE_M * draws[:, 1]
            at[:, 2] = SURFACE_M + STUD_M[2] / 2
            at[:, :3] += FOOT_WORLD
            half = 0.5 * TURN_RAD * draws[:, 2]
            at[:, 3], at[:, 6] = np.cos(half), np.sin(half)
            state["poses"][b] = at
        studs, none = state["poses"][ids, :, :3], np.zeros((len(ids), STUDS), bool)
        state["left_m"][ids] = _left_m(studs, world.robot.tool_world, none)

    def object_poses(self, state: Records, ids: Ints) -> Floats:
        return state["poses"][ids]

    def advance(self, state: Records, rngs: Rngs, world: World, dt_s: float) -> Records:
        """Judge where the pieces are; (B,) of `PICK_PLACE_STEP`."""
        objects = needed(world.objects, "A loose object")
        step = np.zeros(len(state), PICK_PLACE_STEP)
        placed = in_place(objects, self.config)
        left_m = _left_m(objects.position_world, world.robot.tool_world, placed)
        step["progress_m"], state["left_m"] = state["left_m"] - left_m, left_m
        step["placed"] = placed.sum(1) - state["placed"].sum(1)
        step["done"] = placed.all(1)
        state["placed"] = placed
        lowest_m = FOOT_WORLD[2] + SURFACE_M
        state["dropped"] |= (objects.position_world[..., 2] < lowest_m).any(1)
        return step

    def is_terminal(self, step: Records) -> Bools | bool:
        return step["done"]

    def view(self, state: Records, ids: Ints) -> PickPlaceView:
        return PickPlaceView(state["placed"][ids].copy(), places_world())

    def info(self, state: Records) -> dict[str, Floats]:
        """Return how many pieces are placed and left, (B,) each; all placed is a success."""
        placed = state["placed"].sum(1).astype(float)
        return {
            "task/studs_placed": placed,
            "task/studs_left": STUDS - placed,
            "task/dropped": state["dropped"].astype(float),
            "is_success": (placed == STUDS).astype(float),
        }

    def markers(self, view: PickPlaceView) -> Points3:
        return np.broadcast_to(view.places_world, (len(view.placed), STUDS, 3))
