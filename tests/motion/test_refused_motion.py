"""Clips, jobs, grounds and settings of people that are wrong in one thing only are refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.motion import controls as c
from hrc_env.motion import generator
from hrc_env.motion.activities.pieces import cut_clips, make_stage
from hrc_env.motion.anatomy import ANKLE_Z, LEG, N_SIZES, STAND_Z, measure_bodies
from hrc_env.motion.clip import RECORDED, Clip, load_clip, save_clip
from hrc_env.motion.config import PeopleConfig
from hrc_env.motion.floorplan import CELL_M, count_room, make_floorplan
from hrc_env.motion.schedule import Job, check_jobs
from hrc_env.worker.body import load_body
from hrc_env.world import Grounds, Workplace

SIZE = measure_bodies(load_body()).lengths[0]
STILL = Clip(np.zeros((3, c.N_CONTROLS)), 100.0, np.ones((3, 2), bool), SIZE, "still")


def put(array: np.ndarray, at: tuple[int, ...] | int, value: float) -> np.ndarray:
    """Return a copy with one number replaced."""
    changed = array.copy()
    changed[at] = value
    return changed


def gone(x_m: float = 0.0, y_m: float = 0.0) -> np.ndarray:
    """Return controls of somebody who goes so far from the second frame to the last."""
    controls = np.zeros((3, c.N_CONTROLS))
    controls[2, [c.ROOT_X, c.ROOT_Y]] = x_m, y_m
    return controls


def far(column: int, away_m: float) -> np.ndarray:
    """Return controls of somebody who is so far away all the time."""
    controls = np.zeros((3, c.N_CONTROLS))
    controls[:, column] = away_m
    return controls


NARROW = np.zeros((3, c.N_CONTROLS - 1))
TAKEN_CLIPS = {
    "slowest": {"fps": 5.0},
    "fastest": {"fps": 1000.0},
    "shortest": {"controls": np.zeros((2, c.N_CONTROLS)), "contacts": np.zeros((2, 2), bool)},
    "farthest ahead": {"controls": far(c.ROOT_X, 200.0)},
    "farthest aside": {"controls": far(c.ROOT_Y, -200.0)},
    "quickest": {"controls": gone(0.0, 0.15 - 1e-9)},
    "quickest across": {"controls": gone(0.09, -0.12)},
    "quickest of all that are exact": {"controls": gone(1.5), "fps": 10.0},
}  # fmt: skip
REFUSED_CLIPS = {
    "too slow": ({"fps": np.nextafter(5.0, 0.0)}, "a frame rate between 5 and 1000"),
    "too fast": ({"fps": np.nextafter(1000.0, 2000.0)}, "a frame rate between 5 and 1000"),
    "no rate": ({"fps": np.nan}, "a frame rate between 5 and 1000"),
    "one frame": ({"controls": np.zeros((1, c.N_CONTROLS)), "contacts": np.zeros((1, 2), bool)},
                  "controls must have"),
    "a control too few": ({"controls": NARROW}, "controls must have"),
    "an axis too many": ({"controls": np.zeros((3, c.N_CONTROLS, 1))}, "controls must have"),
    "an axis too few": ({"controls": np.zeros(c.N_CONTROLS)}, "controls must have"),
    "contacts of fewer frames": ({"contacts": np.ones((2, 2), bool)}, "contacts must have"),
    "contacts of one foot": ({"contacts": np.ones((3, 1), bool)}, "contacts must have"),
    "a length too few": ({"size": SIZE[:-1]}, "size must have shape"),
    "a control that is none": ({"controls": put(gone(), (2, -1), np.nan)}, "finite numbers"),
    "a length that is none": ({"size": put(SIZE, N_SIZES - 1, np.inf)}, "finite numbers"),
    "no legs": ({"size": put(SIZE, LEG, 0.0)}, "finite numbers"),
    "legs upside down": ({"size": put(SIZE, LEG, -0.8)}, "finite numbers"),
    "too far ahead": ({"controls": far(c.ROOT_X, -200.001)}, "the root moves 200 m"),
    "too far aside": ({"controls": far(c.ROOT_Y, 200.001)}, "the root moves 200 m"),
    "too quick ahead": ({"controls": gone(-0.15001)}, "at up to 15 m/s"),
    "too quick aside": ({"controls": gone(0.0, 0.15001)}, "at up to 15 m/s"),
    "too quick across": ({"controls": gone(0.09001, 0.12)}, "at up to 15 m/s"),
}  # fmt: skip


@pytest.mark.parametrize("name", TAKEN_CLIPS)
def test_a_clip_may_be_as_long_far_and_fast_as_that(name):
    assert replace(STILL, **TAKEN_CLIPS[name]).source == "still"


@pytest.mark.parametrize("name", REFUSED_CLIPS)
def test_a_clip_in_which_one_thing_is_wrong_is_refused(name):
    fields, said = REFUSED_CLIPS[name]
    with pytest.raises(ConfigError, match=f"still: .*{said}"):
        replace(STILL, **fields)


def written(path: Path, without: str = "", **changes: object) -> Path:
    """Return the path of a clip's file with some arrays replaced, or one left out."""
    save_clip(STILL, path)
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files if name != without}
    np.savez(path, **(arrays | changes))
    return path


def test_a_file_of_a_clip_is_taken_with_more_than_a_clip_in_it(tmp_path):
    assert load_clip(written(tmp_path / "own.npz")) == STILL
    assert load_clip(written(tmp_path / "own.npz", more=np.zeros(3))) == STILL


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"version": 0}, "expected a clip of version 1"),
        ({"version": 2}, "expected a clip of version 1, got version 2"),
        ({"without": "version"}, "expected a clip of version 1, got arrays"),
        *(
            ({"without": name}, "expected a clip of version 1")
            for name in ("controls", "fps", "contacts", "size", "source")
        ),
        ({"controls": np.zeros((3, len(RECORDED) - 1))}, "controls must be"),
        ({"controls": np.zeros((3, len(RECORDED) + 1))}, "controls must be"),
        ({"controls": np.zeros(len(RECORDED))}, "controls must be"),
        ({"controls": np.zeros((3, len(RECORDED), 1))}, "controls must be"),
        ({"controls": np.array([{}])}, "is damaged or not a clip"),
    ],
)
def test_a_file_of_a_clip_in_which_one_thing_is_wrong_is_refused(tmp_path, changes, said):
    path = written(tmp_path / "own.npz", **changes)
    with pytest.raises(ConfigError, match=said) as refused:
        load_clip(path)
    assert "own.npz" in str(refused.value)


def test_a_file_that_is_none_or_not_there_is_refused(tmp_path):
    broken = tmp_path / "broken.npz"
    for content in (b"", b"PK", b"no clip"):
        broken.write_bytes(content)
        with pytest.raises(ConfigError, match=r"broken\.npz is damaged or not a clip"):
            load_clip(broken)
    with pytest.raises(ConfigError, match=r"The clip .* does not exist"):
        load_clip(tmp_path / "none.npz")


def lifted(n_frames: int, left_m: float, right_m: float, fps: float = 100.0) -> Clip:
    """Return a clip of somebody who stands, the feet so far above the floor but at both ends."""
    controls = np.zeros((n_frames, c.N_CONTROLS))
    controls[:, c.PELVIS_Z] = SIZE[STAND_Z]
    for at, up_m in ((c.ANKLE, left_m), (c.ANKLE + 6, right_m)):
        controls[:, at + 2] = SIZE[ANKLE_Z] + up_m
    return Clip(controls, fps, np.ones((n_frames, 2), bool), SIZE, "own")


def stepping(first: int, last: int) -> Clip:
    """Return a clip of somebody whose feet are on the floor in two of 70 frames only."""
    clip = lifted(70, 0.2, 0.2)
    clip.controls[[first, last]] = lifted(2, 0.0, 0.0).controls
    return clip


@pytest.mark.parametrize(
    ("clip", "n_found"),
    [
        (stepping(10, 60), None),
        (stepping(11, 60), 2),
        (stepping(60, 60), 1),
        (lifted(51, 0.0, 0.0), None),
        (lifted(50, 0.0, 0.0), 50),
        (lifted(51, 0.0499, 0.0499), None),
        (lifted(51, 0.0501, 0.0), 0),
        (lifted(51, 0.0, 0.0501), 0),
        (lifted(26, 0.0, 0.0, 50.0), None),
        (lifted(25, 0.0, 0.0, 50.0), 25),
    ],
)
def test_a_clip_is_played_from_feet_on_the_floor_to_feet_on_the_floor_half_a_second_later(
    clip, n_found
):
    """Below 5 cm both are on the floor."""
    pile = Workplace("pile", "pile", (1.2, 0.0), 0.0, 0.4)
    where = make_stage(make_floorplan(grounds_of(pile)), generator.MotionConfig())
    if n_found is None:
        assert len(cut_clips([clip], SIZE[None], where).count) > 0
        return
    said = f"own: both feet are within 5 cm of the floor at {n_found} frames within 0.5 s only"
    with pytest.raises(ConfigError, match=said):
        cut_clips([clip], SIZE[None], where)


PEOPLE = [
    ("pause_probability", 0.0, -1e-9, "pause_probability must lie in"),
    ("sudden_probability", 1.0, 1.0 + 1e-9, "sudden_probability must lie in"),
    ("speed_m_s", (0.3, 0.3), (0.29999, 0.3), r"speed_m_s must lie in \[0.3, 2\]"),
    ("speed_m_s", (2.0, 2.0), (2.0, 2.00001), r"speed_m_s must lie in \[0.3, 2\]"),
    ("speed_m_s", (0.3, 2.0), (1.00001, 1.0), r"speed_m_s must be \(low, high\)"),
    ("run_m_s", (2.0, 2.0), (1.99999, 2.0), r"run_m_s must lie in \[2, 4\]"),
    ("run_m_s", (4.0, 4.0), (4.0, 4.00001), r"run_m_s must lie in \[2, 4\]"),
    ("run_m_s", (2.0, 4.0), (3.00001, 3.0), r"run_m_s must be \(low, high\)"),
    ("pause_s", (0.0, 0.0), (-1e-9, 1.0), "pause_s must be 0 or more"),
    ("pause_s", (1.0, 1.0), (1.00001, 1.0), r"pause_s must be \(low, high\)"),
    ("lie_s", (2.0, 2.0), (2.00001, 2.0), r"lie_s must be \(low, high\)"),
    ("tempo", 1e-9, 0.0, "tempo must be positive"),
    ("tempo", 1.0, np.nan, "tempo must be positive"),
    ("notice_m", 0.0, -1e-9, "notice_m must be 0 or more"),
]


@pytest.mark.parametrize(("name", "taken", "refused", "said"), PEOPLE)
def test_settings_of_people_end_where_they_say(name, taken, refused, said):
    free = {"pause_probability": 0.0, "step_back_probability": 0.0}
    assert getattr(PeopleConfig(**(free | {name: taken})), name) == taken
    with pytest.raises(ConfigError, match=said):
        PeopleConfig(**(free | {name: refused}))


def test_pauses_and_steps_back_are_parts_of_the_same_time():
    PeopleConfig(pause_probability=0.75, step_back_probability=0.25)
    with pytest.raises(ConfigError, match=r"pause_probability \+ step_back_probability must be"):
        PeopleConfig(pause_probability=0.75, step_back_probability=0.25001)


@pytest.mark.parametrize(
    ("name", "taken", "refused", "said"),
    [
        ("spacing_m", 0.8, 0.79999, "spacing_m must be 0.8 or more"),
        ("near_radius_m", (1.0, 1.0), (1.00001, 1.0), r"near_radius_m must be \(low, high\)"),
        ("dwell_s", (6.0, 6.0), (6.00001, 6.0), r"dwell_s must be \(low, high\)"),
        ("near_probability", 0.0, -1e-9, "near_probability must lie in"),
        ("motions_probability", 1.0, 1.00001, "motions_probability must lie in"),
        ("motions", ("walk.npz", STILL), ("walk.npz", 3), "motions must be paths or clips"),
        ("motions", (), (Path("walk.npz"),), "motions must be paths or clips"),
    ],
)
def test_settings_of_motion_end_where_they_say(name, taken, refused, said):
    assert getattr(generator.MotionConfig(**{name: taken}), name) == taken
    with pytest.raises(ConfigError, match=said):
        generator.MotionConfig(**{name: refused})


FIRST = Job("first", "reach", "robot", (("second", 0.5),))
SECOND = Job("second", "stand", "bench", (("first", 1.0), ("second", 1.0)))


@pytest.mark.parametrize(
    "changes",
    [{}, {"height_m": 0.0}, {"height_m": 2.2}, {"begins": 0.0}, {"then": (("first", 1e-9),)},
     {"then": ()}],
)  # fmt: skip
def test_jobs_in_which_nothing_is_wrong_are_taken(changes):
    check_jobs((FIRST, replace(SECOND, **changes)))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"name": "first"}, "must have different names"),
        ({"activity": "reech"}, "Unknown activity of 'second'"),
        ({"at": "bank"}, "Unknown kind of place of 'second'"),
        ({"prop": "piano"}, "Unknown prop of 'second'"),
        ({"by": "bus"}, "Unknown way to 'second'"),
        ({"then": (("first", 1.0), ("third", 1.0))}, "Unknown job after 'second'"),
        ({"height_m": -1e-9}, "'second': height_m must be 0 to"),
        ({"height_m": 2.20001}, "'second': height_m must be 0 to"),
        ({"height_m": np.nan}, "'second': height_m must be 0 to"),
        ({"begins": -1e-9}, "'second': begins must be 0 or more"),
        ({"then": (("first", 1.0), ("second", 0.0))}, "weights must be > 0"),
        ({"then": (("first", -1.0), ("second", 1.0))}, "weights must be > 0"),
    ],
)
def test_jobs_in_which_one_thing_is_wrong_are_refused(changes, said):
    with pytest.raises(ConfigError, match=said):
        check_jobs((FIRST, replace(SECOND, **changes)))


def test_some_job_is_at_the_robot():
    check_jobs((FIRST, replace(FIRST, name="second")))
    with pytest.raises(ConfigError, match="At least one job must be at the robot"):
        check_jobs((replace(FIRST, at="bench"), SECOND))


def grounds_of(*places: Workplace, half_wall_m: float = 0.5) -> Grounds:
    """Return 4 x 4 m of ground with a wall across its middle, and a robot far away."""
    wall = np.array([[0.0, 0.0, half_wall_m, 9.0, 0.0]])
    return Grounds((-2.0, 2.0), (-2.0, 2.0), wall, places, (-50.0, 0.0), 0.5)


@pytest.mark.parametrize(("gap_m", "taken"), [(0.2201, True), (0.2199, False)])
def test_who_works_at_a_wall_stands_22_cm_away_from_it(gap_m, taken):
    """Measured on grid points: the places are on some."""
    place = Workplace("wall", "wall", (round((0.5 + gap_m) / CELL_M) * CELL_M, 0.0), 0.0, 1.0)
    half_wall_m = place.xy_m[0] - gap_m
    grounds = grounds_of(place, half_wall_m=half_wall_m)
    if taken:
        assert make_floorplan(grounds).grounds is grounds
        return
    with pytest.raises(ConfigError, match=r"'wall' at .* leaves no room to stand: .* 0\.22 m"):
        make_floorplan(grounds)


@pytest.mark.parametrize("bad_place", [0, 1])
def test_one_workplace_without_room_is_enough(bad_place):
    good = Workplace("a", "wall", (1.0, 0.0), 0.0, 1.0)
    bad = replace(good, name="b", xy_m=(0.6, 0.0))
    with pytest.raises(ConfigError, match="'b' at"):
        make_floorplan(grounds_of(*((bad, good) if bad_place == 0 else (good, bad))))


@pytest.mark.parametrize(("half_wall_m", "taken"), [(1.5999, True), (1.6001, False)])
def test_people_need_40_cm_beside_a_wall(half_wall_m, taken):
    """At the far sides of the ground, 2 m from its middle."""
    if taken:
        make_floorplan(grounds_of(half_wall_m=half_wall_m))
        return
    with pytest.raises(ConfigError, match="the whole floor plan is blocked"):
        make_floorplan(grounds_of(half_wall_m=half_wall_m))


def test_grounds_are_measured_from_edge_to_edge():
    plan = make_floorplan(grounds_of())
    n = round(4.0 / CELL_M) + 1
    assert plan.grid.slack.shape == (n, n)
    assert plan.grid.origin.tolist() == [-2.0, -2.0]
    assert plan.grid.slack[[0, -1], 0] == pytest.approx(1.1)  # 1.5 m from the wall, less 0.4 m


def test_as_many_workers_as_fit_are_taken():
    body, grounds = load_body(), grounds_of(half_wall_m=1.0)
    fit = count_room(make_floorplan(grounds), 1.1)
    job = (Job("stay", "stand", "robot", (("stay", 1.0),)),)
    config = generator.MotionConfig(jobs=job, near_probability=0.0)
    assert fit > 1
    with pytest.raises(ConfigError, match=rf"n_workers={fit + 1}: at most {fit} fit"):
        generator.make_state(1, fit + 1, body, config, grounds)
    generator.make_state(1, fit, body, config, grounds)
