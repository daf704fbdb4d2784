"""The gallery draws what it shows, and shows what it draws."""

import re

import imageio.v2 as imageio
import numpy as np
import pytest

from benchmarks.gallery import motions
from benchmarks.gallery.gallery import Exhibit, GalleryConfig, run, write_page
from benchmarks.gallery.motions import FRAMES, STAGED, make_stage, spread_frames
from benchmarks.gallery.still import CASTS
from hrc_env.core.errors import ConfigError
from hrc_env.motion.repertoire import SCENES
from hrc_env.scene.build import build

pytestmark = pytest.mark.slow  # a gallery is drawn


def test_a_page_shows_every_picture_with_its_words(tmp_path):
    shown = [Exhibit("Motions", "a.png", "saw <wood>", "by worker 1", True)]
    write_page(shown, tmp_path, "python -m benchmarks gallery")
    page = (tmp_path / "index.html").read_text()
    assert 'src="a.png"' in page
    assert "saw &lt;wood&gt;" in page
    assert not re.search(r"https?://|<script", page)


def test_a_strip_has_evenly_spread_moments_of_all_its_films():
    chosen = spread_frames([40, 80])
    assert len(chosen) == FRAMES
    assert np.ptp(np.diff([40 * film + row for film, row in chosen])) <= 1
    assert {film for film, _ in chosen} == {0, 1}


def test_every_stage_and_cast_names_what_there_is():
    assert set(STAGED) <= set(SCENES)
    for name in SCENES:
        assert make_stage(name).away_m > 1.0
    for scene, cast in CASTS.items():
        places = {place.name for place in build(name=scene).grounds.places}
        assert {place for place, *_ in cast} <= places
        assert {doing for _, doing, _ in cast} <= set(SCENES)


def test_an_unknown_motion_is_told_the_valid_ones():
    with pytest.raises(ConfigError, match="hammer"):
        GalleryConfig(motions=("hamer on a table",))


def test_a_small_gallery_is_a_page_of_pictures_that_show_something(tmp_path, monkeypatch):
    monkeypatch.setattr(motions, "FRAMES", 2)
    said = []
    config = GalleryConfig(bodies=("worker_1",), motions=("stand",), scenes=())
    shown = run(config, tmp_path, lambda share, name: said.append(share))
    assert sum(said) == pytest.approx(1.0)
    page = (tmp_path / "index.html").read_text()
    for exhibit in shown:
        assert exhibit.file in page
        assert imageio.imread(tmp_path / exhibit.file).std() > 20
