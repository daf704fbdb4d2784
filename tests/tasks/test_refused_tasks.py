"""A task, its settings or its goals that are wrong in one thing only are refused."""

from dataclasses import dataclass, make_dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from hrc_env.core.errors import ConfigError, NoGoalError
from hrc_env.geometry.ways import value_at
from hrc_env.observations import SHARED_TERMS
from hrc_env.registration import register_task
from hrc_env.rewards import SHARED_TERMS as SHARED_REWARDS
from hrc_env.scene.build import build
from hrc_env.tasks import delivery
from hrc_env.tasks.check import REQUIRED, check_task
from hrc_env.tasks.delivery import Delivery, DeliveryConfig
from hrc_env.tasks.drywall import DrywallConfig
from hrc_env.tasks.goal import compute_reward
from hrc_env.tasks.pick_place_goal import PickPlaceGoalConfig
from hrc_env.tasks.reach import ReachConfig
from hrc_env.tasks.task import TASKS, Task, TaskType, find_task, require_goal
from tests.tasks.variants import vary

REACH, WITH_GOAL = find_task("HRCReach-v0"), find_task("HRCReachGoal-v0")


@dataclass
class Arrays:
    """A state of several arrays."""

    first: np.ndarray
    second: np.ndarray


def state_of(first: int, second: int) -> TaskType:
    """Return a task whose state is two arrays of so many rows."""
    info = {name: np.zeros(2) for name in (REACH.achieved, REACH.failed, "is_success")}
    return vary(
        REACH,
        make_state=lambda self, batch: Arrays(np.zeros((first, 3)), np.zeros(second)),
        info=lambda self, state: info,
    )


def saying(without: str = "", **others: object) -> TaskType:
    """Return a task whose info lacks something or says more."""

    def info(self, state: np.ndarray) -> dict[str, object]:
        said = {name: value for name, value in REACH().info(state).items() if name != without}
        return said | {name.replace("_at_", "/"): value for name, value in others.items()}

    return vary(REACH, info=info)


@pytest.mark.parametrize(
    "task",
    [REACH, WITH_GOAL, state_of(2, 2), saying(task_at_more=np.zeros(2)),
     vary(REACH, id="Other-v12")],
)  # fmt: skip
def test_a_task_in_which_nothing_is_wrong_is_taken(task):
    check_task(task)


REFUSED = {
    "no task": ("HRCReach-v0", "must be a class that derives from hrc_env.Task, got str"),
    "an id that is no text": (vary(REACH, id=3), "must be like"),
    "an id without a version": (vary(REACH, id="Tend"), "must be like"),
    "an id with something behind": (vary(REACH, id="Tend-v0 "), "must be like"),
    "an id with something before": (vary(REACH, id=" Tend-v0"), "must be like"),
    **{
        f"no {name}": (vary(REACH, **{name: None}), f"{name} must be a method")
        for name in (*REQUIRED, "markers", "is_terminal")
    },
    "a former name": (vary(REACH, over=lambda self, step: True), "over is called is_terminal now"),
    "nearly a hook": (vary(REACH, is_terminl=lambda self, step: True), "Did you mean is_terminal"),
    "other arguments": (vary(REACH, view=lambda self, state: None), "view must be a method of"),
    "an object of a task": (REACH(), "register the class Reach itself"),
    "terms in a list": (vary(REACH, rewards=[]), "rewards must be a tuple of RewardTerm"),
    "settings that are an object": (vary(REACH, config_type=ReachConfig()), "must be a dataclass"),
    "settings of another kind": (vary(REACH, config_type=dict), "must be a dataclass"),
    "settings without a default": (
        vary(REACH, config_type=make_dataclass("Own", ["x"])), "needs a default"),
    "an observation twice": (
        vary(REACH, observations=(*REACH.observations, SHARED_TERMS[0])),
        f"term {SHARED_TERMS[0].name!r} exists already"),
    "a reward twice": (
        vary(REACH, rewards=(*REACH.rewards, SHARED_REWARDS[-1])),
        f"term {SHARED_REWARDS[-1].name!r} exists already"),
    "another goal": (
        vary(WITH_GOAL, goal=SimpleNamespace(doc="near")), "goal must be a Goal, got Simple"),
    "a state that is a list": (
        vary(REACH, make_state=lambda self, batch: [0.0] * batch), "got list"
    ),
    "a state of fewer rows": (
        vary(REACH, make_state=lambda self, batch: np.zeros(1)), "state must have"
    ),
    "a first array of fewer rows": (state_of(1, 2), r"state\.first must have shape \(2,\)"),
    "a second array of more rows": (state_of(2, 3), r"state\.second must have shape \(2,\)"),
    **{
        f"no {name} in info": (saying(without=name), f"info must hold {name!r}")
        for name in (REACH.achieved, REACH.failed, "is_success")
    },
    "no name of a count": (vary(REACH, achieved=""), "achieved must be the name in info"),
    "a count that is no name": (vary(REACH, failed=None), "failed must be the name in info"),
    "one count for both": (vary(REACH, failed=REACH.achieved), "achieved and failed must be two"),
    "a name of no task in info": (saying(more=np.zeros(2)), "must begin with 'task/', got 'more'"),
    "one number for two": (saying(task_at_more=0.0), r"info\['task/more'\] must have shape \(2,\)"),
    "one success for two": (saying(is_success=True), r"info\['is_success'\] must have shape"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_a_task_in_which_one_thing_is_wrong_is_refused(name):
    task, said = REFUSED[name]
    with pytest.raises(ConfigError, match=said):
        check_task(task)


def test_a_task_without_a_hook_is_refused():
    class Bare(Task):
        id = "Bare-v0"

    with pytest.raises(ConfigError, match=r"Bare-v0: the method \w+ is missing"):
        check_task(Bare)


def test_the_base_class_is_no_task():
    with pytest.raises(ConfigError, match="Task is a base class"):
        Task("HRCTend-v0", "Go to and fro.")


SHAPES = {
    "a view of another shape": (
        {"view": lambda self, state, ids: SimpleNamespace(
            goal_world=np.zeros((1, 3)), time_left_s=np.zeros(7))},
        "rows of observation term 'goal_time_left'"),
    "ends of other environments": (
        {"is_terminal": lambda self, step: np.zeros(3, bool)}, "is_terminal must have shape"),
    "starts of another robot": (
        {"draw_start": lambda self, rngs, place, home_q, spread_rad: np.zeros((len(rngs), 5))},
        "draw_start must have shape"),
    "poses of objects that there are not": (
        {"object_poses": lambda self, state, ids: np.zeros((len(ids), 2, 7))},
        "object_poses must have shape"),
}  # fmt: skip


@pytest.mark.parametrize("name", SHAPES)
def test_wrong_shapes_are_said_at_registration(name):
    changes, said = SHAPES[name]
    with pytest.raises(ConfigError, match=said):
        register_task(vary(REACH, id="HRCShapes-v0", **changes))
    assert "HRCShapes-v0" not in TASKS


@pytest.mark.parametrize("name", ["HRCReech-v0", "", "HRCReach"])
def test_a_task_that_there_is_not_is_refused(name):
    with pytest.raises(ConfigError, match="Unknown task"):
        find_task(name)


def test_goals_are_those_of_tasks_that_have_some():
    assert require_goal(WITH_GOAL()) is WITH_GOAL.goal
    with pytest.raises(NoGoalError, match="HRCReach-v0 has no goals"):
        require_goal(REACH())


@pytest.mark.parametrize(
    ("achieved", "desired"),
    [
        (np.zeros(3), np.zeros(4)),
        (np.zeros((2, 3)), np.zeros((3, 3))),
        (np.zeros((1, 3)), np.zeros(3)),
        (np.zeros((1, 2, 3)), np.zeros((1, 2, 3))),
        (np.zeros(()), np.zeros(())),
        (np.zeros((3, 2)), np.zeros((3, 2))),
        (np.zeros((2, 3)), np.array([[0.0, 0.0, 0.0], [0.0, np.inf, 0.0]])),
        (np.array([np.nan, 0.0, 0.0]), np.zeros(3)),
    ],
)
def test_goals_that_cannot_be_compared_are_refused(achieved, desired):
    with pytest.raises(ConfigError, match=r"must (both have|have|be finite)"):
        compute_reward(WITH_GOAL.goal, achieved, desired, None, WITH_GOAL.config_type())


@pytest.mark.parametrize("shape", [(3,), (1, 3), (4, 3)])
def test_goals_that_can_be_compared_are(shape):
    value = compute_reward(
        WITH_GOAL.goal, np.zeros(shape), np.zeros(shape), None, WITH_GOAL.config_type()
    )
    assert np.shape(value) == shape[:-1]


RANGES = [
    (ReachConfig, "distance_m", (0.5, 0.5), (0.5, 0.6)),
    (ReachConfig, "azimuth_rad", (0.1, 0.0), (0.0, 0.1)),
    (ReachConfig, "height_m", (1.0, 1.0), (1.0, 1.1)),
    (ReachConfig, "distance_m", (np.nan, 0.5), (0.4, 0.5)),
    (DrywallConfig, "push_n", (-0.001, 20.0), (0.0, 20.0)),
    (DrywallConfig, "push_n", (20.0, 19.999), (20.0, 20.0)),
    (DrywallConfig, "push_n", (20.0, np.nan), (0.0, 0.0)),
    (DeliveryConfig, "way_m", (0.0, 4.0), (1e-9, 4.0)),
    (DeliveryConfig, "way_m", (-1.0, 4.0), (3.9, 4.0)),
    (DeliveryConfig, "way_m", (4.0, 4.0), (4.0, 4.1)),
    (PickPlaceGoalConfig, "reward", "dense", "each"),
    (PickPlaceGoalConfig, "reward", "", "all"),
]


@pytest.mark.parametrize(("config", "name", "refused", "taken"), RANGES)
def test_ranges_end_where_they_begin_at_the_earliest(config, name, refused, taken):
    assert getattr(config(**{name: taken}), name) == taken
    with pytest.raises(ConfigError, match=name):
        config(**{name: refused})


def test_a_place_for_deliveries_has_one_way_that_is_as_long_as_is_asked():
    """Neither too short nor too long, both ends included."""
    grounds = build(name="site", robot="mobile_base").map
    lengths = Delivery().survey(grounds).lengths
    ways_m = np.unique(lengths[np.isfinite(lengths) & (lengths > 0.0)])
    shortest, longest = float(ways_m[0]), float(ways_m[-1])
    gap = int(np.argmax(np.diff(ways_m)))
    below, above = float(ways_m[gap]), float(ways_m[gap + 1])
    tiny = 1e-9
    for taken in ((longest, longest + 1.0), (0.5 * shortest, shortest), (below, above - tiny)):
        Delivery(DeliveryConfig(way_m=taken)).survey(grounds)
    for refused in (
        (longest + tiny, longest + 1.0), (0.5 * shortest, shortest - tiny),
        (below + tiny, above - tiny),
    ):  # fmt: skip
        said = rf"has {len(lengths)} zones, and its longest path is {longest:.1f} m"
        with pytest.raises(ConfigError, match=said):
            Delivery(DeliveryConfig(way_m=refused)).survey(grounds)


def test_ways_between_zones_are_those_that_are_looked_up_there():
    grounds = build(name="site", robot="mobile_base").map
    site = Delivery().survey(grounds)
    for one, at in enumerate(site.zones.tolist()):
        for other, ways in enumerate(site.ways):
            found_m = value_at(*at, ways, site.origin, delivery.CELL_M)
            assert site.lengths[one, other] == pytest.approx(found_m, abs=1e-6)


def test_a_place_without_zones_has_no_ways():
    grounds = build(name="site", robot="mobile_base").map
    full = replace(grounds, blocked=np.array([[0.0, 0.0, 99.0, 99.0, 0.0]]))
    with pytest.raises(ConfigError, match=r"has 0 zones, and its longest path is 0\.0 m"):
        Delivery().survey(full)
