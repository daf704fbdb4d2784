"""Films: their frames, their table, and which episode is filmed."""

import imageio.v2 as imageio
import numpy as np
import pytest
from rich.console import Console

from hrc_env.agents.registry import make_agent
from hrc_env.cli.play import make_table
from hrc_env.core.errors import RenderingError
from hrc_env.evaluation import film


def scripted(env_info):
    return make_agent("scripted", env_info)


def test_a_film_has_a_frame_for_every_second_step(tmp_path):
    path = tmp_path / "film.mp4"
    totals = film.film_episode(scripted, path, 3, n_steps=7, perception="truth")
    reader = imageio.get_reader(path)
    assert reader.count_frames() == 4
    assert reader.get_meta_data()["size"] == (1600, 900)
    assert reader.get_meta_data()["fps"] == 12.5
    reader.close()
    assert imageio.imread(path.with_suffix(".png")).shape == (900, 1600, 3)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["film.mp4", "film.png"]
    assert totals["lost steps [%]"] == 0.0
    assert totals["film drawn [frames/s]"] > 0


def test_a_film_that_cannot_be_drawn_leaves_nothing_behind(tmp_path, monkeypatch):
    def refuse(*_):
        raise RenderingError("no OpenGL")

    monkeypatch.setattr(film, "compose", refuse)
    with pytest.raises(RenderingError, match="no OpenGL"):
        film.film_episode(scripted, tmp_path / "film.mp4", 3, n_steps=4, perception="truth")
    assert list(tmp_path.iterdir()) == []


def test_every_value_of_the_table_has_its_unit():
    console = Console(width=80)
    with console.capture() as capture:
        console.print(
            make_table(
                {
                    "median tracking error [mm]": 15.851,
                    "lost steps [%]": 0.4,
                    "minimum separation [m]": 0.1949,
                    "goals reached [count]": 5.0,
                }
            )
        )
    said = [line.split("│") for line in capture.get().splitlines() if "│" in line]
    rows = [tuple(cell.strip() for cell in line[1:4]) for line in said]
    assert ("median tracking error", "15.9", "mm") in rows
    assert ("lost steps", "0.4", "%") in rows
    assert ("minimum separation", "0.19", "m") in rows
    assert ("goals reached", "5", "count") in rows


@pytest.mark.parametrize(
    ("closest_m", "chosen"),
    [
        ({3: 0.9, 4: 0.2, 5: 0.4}, 4),
        ({3: 0.05, 4: 0.2, 5: 0.4}, 4),  # 3 is a near miss
        ({3: 0.02, 4: 0.05, 5: 0.0}, 4),  # all are: the least close
        ({3: np.inf, 4: 0.8}, 4),
        ({3: 0.3, 4: 0.3}, 3),
    ],
)
def test_the_closest_encounter_without_a_near_miss_is_filmed(monkeypatch, closest_m, chosen):
    monkeypatch.setattr(film, "_find_closest_m", lambda env, make, seed, n_steps: closest_m[seed])
    assert film.find_nearest_seed(scripted, list(closest_m), perception="none") == chosen


def test_the_same_seed_is_chosen_every_time_and_is_the_closest():
    seeds, kwargs = range(3), {"n_steps": 40, "perception": "truth"}
    chosen = film.find_nearest_seed(scripted, seeds, **kwargs)
    assert film.find_nearest_seed(scripted, seeds, **kwargs) == chosen
    env = film.HRCEnv(perception="truth")
    closest_m = {seed: film._find_closest_m(env, scripted, seed, 40) for seed in seeds}
    env.close()
    assert closest_m[chosen] == min(each for each in closest_m.values() if each > film.CLOSE_M)
