"""A machine is made ready, the quickest first: nobody waits for kernels to hear of weights."""

import subprocess

import pytest
from rich.console import Console

from hrc_env.__main__ import main
from hrc_env.core.errors import RenderingError
from hrc_env.core.kernels import ahead
from hrc_env.perception import weights
from hrc_env.pipeline import ready
from hrc_env.scene import gl


@pytest.fixture
def order(monkeypatch):
    """What has been done, in order, on a machine that lacks everything."""
    done = []
    monkeypatch.setattr(weights, "fetch_weights", lambda names: done.append("weights"))
    monkeypatch.setattr(gl, "gl_status", lambda: (done.append("OpenGL") or True, "it draws"))
    monkeypatch.setattr(ahead, "missing", lambda level: ["a kernel"])
    monkeypatch.setattr(ahead, "compile_missing", lambda level, say: done.append("kernels"))
    return done


@pytest.mark.parametrize(
    ("level", "draws", "expected"),
    [
        ("pixels", False, ["weights", "OpenGL", "kernels"]),
        ("truth", True, ["OpenGL", "kernels"]),
        ("truth", False, ["kernels"]),
    ],
)
def test_what_is_quick_comes_first_and_only_what_is_needed(order, level, draws, expected):
    ready.make_ready(Console(), level, draws)
    assert order == expected


def test_without_opengl_no_kernel_is_compiled(order, monkeypatch):
    monkeypatch.setattr(gl, "gl_status", lambda: (False, "there is none"))
    with pytest.raises(RenderingError, match="there is none"):
        ready.make_ready(Console(), "truth", draws=True)
    assert order == []


def test_a_film_without_a_network_says_so_before_anything_is_compiled(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.setenv("HRC_ENV_CACHE", str(tmp_path / "empty"))
    failed = subprocess.CompletedProcess([], 1, "", "ERROR: no route to host")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: failed)
    monkeypatch.setattr(ahead, "compile_missing", lambda *_: pytest.fail("too early"))
    monkeypatch.setattr(ahead, "missing", lambda *_: pytest.fail("too early"))
    assert main(["demo", "--out", str(tmp_path / "film.mp4")]) == 2
    said = capsys.readouterr().err
    for part in ("WeightsError", "no route to host", "Without a network connection, copy"):
        assert part in said


def test_setup_says_where_everything_is(capsys):
    assert main(["setup"]) == 0
    said = capsys.readouterr().out
    for part in ("ok pose network", "ok kernels", "ok headless OpenGL"):
        assert part in said
