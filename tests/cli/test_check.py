"""check must end up with a line for everything, whatever is wrong."""

import signal

import pytest

from hrc_env.cli import check
from hrc_env.core import machine
from hrc_env.core.kernels import ahead
from hrc_env.core.kernels.signatures import recorded

NAMES = check.NAMES


@pytest.fixture
def quick(monkeypatch):
    """Every finding at once, and fine."""
    for name in NAMES:
        monkeypatch.setattr(
            check, f"_check_{name.lower()}", lambda name=name: check.Finding(True, f"{name} [fine]")
        )


def test_every_line_is_ok_where_all_is_well(quick, capsys):
    assert check.Check().run() == 0
    said = capsys.readouterr().out
    assert said.count("ok") == len(NAMES)
    assert "OpenGL [fine]" in said


def test_what_goes_wrong_is_said_in_its_line_and_the_others_follow(quick, monkeypatch, capsys):
    def broken():
        raise AttributeError("no such thing")

    monkeypatch.setattr(check, "_check_opengl", broken)
    assert check.Check().run() == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if line.startswith("TODO")] == [
        "TODO OpenGL       AttributeError: no such thing"
    ]
    assert len(lines) == len(NAMES)


def test_a_process_that_is_killed_is_told_of():
    code = f"import os; os.kill(os.getpid(), {int(signal.SIGSEGV)})"
    assert check._run_in_process(code) == (False, "ended by signal SIGSEGV")


def test_a_process_that_fails_is_told_of_by_its_last_line():
    assert check._run_in_process("raise ValueError('so')") == (False, "ValueError: so")


def test_a_dead_display_is_named_where_one_is_asked_for(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    monkeypatch.setenv("DISPLAY", ":99")
    ok, said = check._check_opengl()
    assert not ok
    assert "No window system is available" in said
    assert "apt-get install" in said


def test_a_pixel_is_drawn_on_this_machine():
    ok, said = check._check_opengl()
    assert ok, said
    assert "OpenGL works" in said


def test_too_little_memory_is_named(monkeypatch):
    monkeypatch.setattr(machine, "usable_memory_gb", lambda: 0.512)
    assert "too little" in check._check_machine()[1]


def test_torch_and_its_build_are_named():
    ok, said = check._check_torch()
    assert ok
    assert "build" in said


def test_kernels_that_are_missing_are_counted(monkeypatch):
    monkeypatch.setattr(ahead, "missing", lambda: [])
    assert check._check_kernels()[1].startswith("compiled")
    monkeypatch.setattr(ahead, "missing", recorded)
    assert check._check_kernels()[1].startswith(f"{len(recorded())} are not compiled yet")
