"""What pictures show beside the scene: goals and markers, capsules; and through which camera."""

from contextlib import closing

import gymnasium
import numpy as np
import pytest

import hrc_env
from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.geometry.cameras import project, resize
from hrc_env.geometry.distances import least_separation
from hrc_env.render import overlay
from hrc_env.render.marks import solids_of
from hrc_env.render.stage import Stage
from hrc_env.scene.canvas import Marks
from hrc_env.scene.render import viewpoint_camera
from hrc_env.vector.env import HRCVectorEnv

SIZE = {"width": 240, "height": 180}
STILL = np.zeros(6, np.float32)


def make(**given) -> HRCEnv:
    return HRCEnv(**{"perception": "truth", "render_mode": "rgb_array", **SIZE, **given})


def unlike(a, b) -> np.ndarray:
    """(H, W) which pixels differ by more than rounding."""
    return (np.abs(a.astype(int) - b) > 8).any(-1)


def at(camera, point_world) -> tuple[int, int]:
    """The row and the column of a point in a picture of a camera."""
    x, y = project(camera.P[None], np.asarray(point_world)[None, None])[0][0, 0, 0]
    return int(y), int(x)


def with_goal(env: HRCEnv, goal_world) -> np.ndarray:
    env.simulation.task_state["goal_world"][0] = goal_world
    return env.render()


def test_a_goal_is_drawn_where_it_is():
    goals = np.array([[0.1, -0.5, 1.3], [0.0, 0.5, 0.9]])
    with closing(make()) as env, closing(make(render_markers=False)) as bare:
        env.reset(seed=0)
        bare.reset(seed=0)
        camera = viewpoint_camera("beside", *SIZE.values())
        pictures = [with_goal(env, goal) for goal in goals]
        for goal, picture in zip(goals, pictures, strict=True):
            row, column = at(camera, goal)
            differs = unlike(picture, bare.render())
            assert differs[row, column]
            rows, columns = np.nonzero(differs)
            assert len(rows) > 20
            assert np.hypot(rows - row, columns - column).max() < 12
        assert unlike(*pictures).sum() > 40


def test_a_goal_behind_something_is_faint():
    with closing(make()) as env, closing(make(render_markers=False)) as bare:
        env.reset(seed=0)
        bare.reset(seed=0)
        camera, eye = viewpoint_camera("beside", *SIZE.values()), np.array([0.45, -2.62, 1.95])
        floor = np.array([0.3, 0.2, 0.0])
        before, under = (eye + share * (floor - eye) for share in (0.97, 1.05))
        strength = []
        for goal in (before, under):
            row, column = at(camera, goal)
            off = with_goal(env, goal)[row, column].astype(int) - bare.render()[row, column]
            strength.append(np.abs(off).sum())
        assert strength[0] > 1.5 * strength[1] > 0


def test_every_task_s_markers_are_drawn():
    for task in ("HRCReachGoal-v0", "HRCPickPlace-v0", "HRCDrywall-v0", "HRCDelivery-v0"):
        shown = []
        for markers in (True, False):
            with closing(make(task=task, perception="none", render_markers=markers)) as env:
                env.reset(seed=3)
                shown.append(env.render())
        assert unlike(*shown).any(), task


def test_depth_is_of_the_scene_alone():
    depths = []
    for markers in (True, False):
        with closing(make(render_mode="depth_array", render_markers=markers)) as env:
            env.reset(seed=0)
            depths.append(env.render())
    np.testing.assert_array_equal(*depths)


def test_wrappers_that_collect_pictures_get_the_goal():
    """As `gymnasium.wrappers.RecordVideo` does, they keep what `render` gives."""
    frames = []
    for markers in (True, False):
        env = gymnasium.make(
            "HRCReach-v0", perception="none", render_mode="rgb_array_list",
            render_markers=markers, **SIZE,
        )  # fmt: skip
        env.reset(seed=0)
        env.step(STILL)
        frames.append(env.render()[-1])
        env.close()
    assert unlike(*frames).any()


def test_capsules_of_robot_and_people_are_laid_over_the_scene():
    with closing(make(overlay="capsules")) as env, closing(make()) as bare:
        env.reset(seed=7)
        bare.reset(seed=7)
        picture, plain = env.render(), bare.render()
        camera = viewpoint_camera("beside", *SIZE.values())
        robot, believed, true = solids_of(env.simulation, 0)
        assert [len(each.radius_m) > 0 for each in (robot, believed, true)] == [True] * 3
        for solids, colour in ((robot, overlay.LEFT), (true, overlay.RIGHT)):
            points = solids.ends_world.mean(1)
            spots = [at(camera, point) for point in points]
            seen = [(r, c) for r, c in spots if 0 <= r < 180 and 0 <= c < 240]
            nearer = [
                np.abs(picture[spot].astype(int) - colour).sum()
                < np.abs(plain[spot].astype(int) - colour).sum()
                for spot in seen
            ]
            assert np.mean(nearer) > 0.5
        assert 0.02 < unlike(picture, plain).mean() < 0.5


def test_a_capsule_is_drawn_from_end_to_end():
    ends, radius_m = np.array([[-0.4, 0.0, 1.0], [0.6, 0.0, 1.0]]), 0.06
    marks = Marks(ends[None], np.array([radius_m]), np.array([[1.0, 0.0, 0.0]]))
    with closing(make()) as env:
        env.reset(seed=0)
        stage, camera = (
            Stage(env.simulation.scene, *SIZE.values()),
            viewpoint_camera("room", 240, 180),
        )
        stage.pose(*env.views.pose())
        picture = stage.picture(camera)
        marked = picture.copy()
        stage.mark(marked, camera, marks, 1.0, 1.0)
        stage.close()
    along = ends[1] - ends[0]
    inside = [ends[0] + share * along for share in (-0.04, 0.0, 0.3, 0.7, 1.0, 1.04)]
    outside = [ends[0] + share * along for share in (-0.15, 1.15)]
    differs = unlike(marked, picture)
    assert all(differs[at(camera, point)] for point in inside)
    assert not any(differs[at(camera, point)] for point in outside)


def test_capsules_are_what_distances_are_taken_of():
    with closing(make(perception="keypoints")) as env:
        env.reset(seed=7)
        for _ in range(10):
            info = env.step(STILL)[4]
        robot, believed, true = solids_of(env.simulation, 0)
        for people, expected in (
            (believed, env.simulation.belief.separation.distance_m[0, 0]),
            (true, info["safety/min_separation_m"]),
        ):
            gap = least_separation(
                robot.ends_world, robot.radius_m, people.ends_world, people.radius_m
            )
            assert -1e-3 < float(gap.distance_m) - float(expected) < 0.03  # of the step's end


def test_who_is_not_tracked_has_no_believed_capsules():
    with closing(make(perception="none", overlay="capsules")) as env:
        env.reset(seed=0)
        assert len(solids_of(env.simulation, 0)[1].radius_m) == 0
        assert env.render().std() > 20


def test_a_picture_through_each_camera_of_the_rig():
    with closing(make(render_markers=False)) as env:
        env.reset(seed=0)
        by_name = [env.render(camera=f"camera_{k}") for k in (1, 2, 3, 4)]
        for k, picture in enumerate(by_name):
            np.testing.assert_array_equal(env.render(camera=k), picture)
            assert picture.shape == (180, 240, 3)
        assert all(unlike(by_name[0], other).mean() > 0.3 for other in by_name[1:])
        assert unlike(env.render(camera="top"), env.render()).mean() > 0.3


def test_a_camera_of_ones_own_sees_what_it_looks_at():
    own = hrc_env.CameraConfig(
        "own", (1.0, -1.5, 1.6), (0.0, 0.2, 1.1), width_px=640, height_px=480
    )
    with closing(make()) as env:
        env.reset(seed=0)
        goal = np.array([0.0, 0.2, 1.1])
        picture = env.views.picture(size=(320, 240), camera=own)
        env.simulation.task_state["goal_world"][0] = goal
        marked = env.views.picture(size=(320, 240), camera=own)
        (camera,) = hrc_env.make_cameras([own])
        row, column = at(resize(camera, 320, 240), goal)
        assert (row, column) == (120, 160)
        assert unlike(picture, marked)[row, column]


def test_depth_through_a_camera():
    with closing(make(render_mode="depth_array")) as env:
        env.reset(seed=0)
        depth_m = env.render(camera="camera_1")
    assert depth_m.shape == (180, 240)
    assert 1.0 < np.median(depth_m) < 10.0


def test_a_lens_bends_the_picture_and_markers_are_rings():
    with closing(make(cameras="lab_gopro")) as env:
        env.reset(seed=0)
        with_ring = env.render(camera=2)
        without = env.views.picture(size=(240, 180), camera=2, markers=False)
    assert unlike(with_ring, without).any()


def test_many_environments_are_seen_through_a_camera():
    many = HRCVectorEnv(2, perception="truth", render_mode="rgb_array", num_threads=2, **SIZE)
    with closing(make()) as env, closing(many):
        many.reset(seed=3)
        env.reset(seed=4)
        picture = env.render(camera="camera_2")
        np.testing.assert_array_equal(many.render(camera="camera_2")[1], picture)
        np.testing.assert_array_equal(many.member(1).render(camera=1), picture)
        np.testing.assert_array_equal(many.render()[1], env.render())


def test_many_environments_take_what_is_shown_beside_the_scene():
    how = {"overlay": "capsules", "render_markers": False}
    many = HRCVectorEnv(2, perception="truth", render_mode="rgb_array", **SIZE, **how)
    with closing(make(**how)) as env, closing(many):
        many.reset(seed=3)
        env.reset(seed=4)
        np.testing.assert_array_equal(many.render()[1], env.render())


@pytest.mark.parametrize(
    ("camera", "said"),
    [
        ("camera_9", "Unknown camera or viewpoint 'camera_9'. Did you mean 'camera_"),
        (4, r"camera \(of camera_1, .*\) must be a whole number from 0 to 3, got 4"),
        (-1, "got -1"),
        (True, "got True"),
        (1.5, "got 1.5"),
    ],
)
def test_a_camera_that_is_none_is_told_which_are(camera, said):
    with closing(make(perception="none")) as env:
        env.reset(seed=0)
        with pytest.raises(ConfigError, match=said):
            env.render(camera=camera)


def test_lists_of_pictures_are_from_the_usual_viewpoint():
    env = HRCVectorEnv(2, perception="none", render_mode="rgb_array_list", **SIZE)
    with closing(env):
        env.reset(seed=0)
        with pytest.raises(ConfigError, match="leave out camera='top'"):
            env.render(camera="top")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"overlay": "capsule"}, "Unknown overlay 'capsule'. Did you mean 'capsules'"),
        ({"overlay": True}, "Unknown overlay True"),
        ({"render_markers": "no"}, "render_markers must be True or False, got 'no'"),
        ({"render_markers": None}, "got None"),
    ],
)
def test_what_cannot_be_shown_is_answered_at_making(given, said):
    with pytest.raises(ConfigError, match=said):
        HRCEnv(perception="none", **given)
    with pytest.raises(ConfigError, match=said):
        HRCVectorEnv(2, perception="none", **given)
