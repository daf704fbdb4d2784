"""The interactive window's model; the window itself needs a display."""

import mujoco
import pytest

from hrc_env.core.errors import RenderingError
from hrc_env.scene.build import build, drawing_model
from hrc_env.scene.viewer import Viewer

SHOWN_AT_FIRST = (0, 1, 2)


def test_the_window_would_show_arm_and_worker():
    scene = build(n_workers=1)
    model = drawing_model(scene)
    assert model.nskin == 2
    arm = [g for g in range(model.ngeom) if model.geom_bodyid[g] == model.body("robot/forearm").id]
    assert any(model.geom_group[g] in SHOWN_AT_FIRST for g in arm)
    assert model is not scene.model


def test_without_a_display_it_says_how_to_film_instead(monkeypatch):
    monkeypatch.setattr("mujoco.viewer.launch_passive", _no_display)
    with pytest.raises(RenderingError, match="--video"):
        Viewer(build(n_workers=1))


def _no_display(*_: object) -> None:
    raise mujoco.FatalError("no display")
