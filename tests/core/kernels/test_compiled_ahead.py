"""What a perception level needs is compiled before, in processes of their own."""

import json
import logging
import subprocess
import sys
import time
from dataclasses import replace

import pytest

from hrc_env.core.kernels import ahead, cache, signatures

PLAY = """
import json, warnings
import gymnasium, hrc_env
from hrc_env.core.kernels import KERNELS
from hrc_env.core.kernels.signatures import encode
warnings.simplefilter("ignore")
env = gymnasium.make("HRCReach-v0", perception={level!r})
envs = gymnasium.make_vec("HRCReach-v0", 3, perception={level!r})
env.reset(seed=0)
envs.reset(seed=0)
for _ in range(20):
    env.step(env.action_space.sample())
    envs.step(envs.action_space.sample())
print(json.dumps([[name, [encode(each) for each in args]] for name, kernel in KERNELS.items()
                  for args in kernel.overloads]))
"""


PLAY_FIRST = """
import json, warnings
import gymnasium, hrc_env
from hrc_env.core.kernels import KERNELS
from hrc_env.core.kernels.signatures import encode
warnings.simplefilter("ignore")
env = gymnasium.make("HRCReach-v0", perception={level!r})
env.reset(seed=0)
env.step(env.action_space.sample())
print(json.dumps([[name, [encode(each) for each in args]] for name, kernel in KERNELS.items()
                  for args in kernel.overloads]))
"""
SAY_WHAT_IS_DONE = """
from hrc_env.core.kernels import ahead, signatures
from pathlib import Path
signatures.PATH = Path({path!r})
print(ahead.compile_missing(None, lambda share, name: print(name)))
"""


@pytest.fixture
def two_kernels(tmp_path, monkeypatch):
    """A folder in which nothing is compiled, and two small kernels that are to be."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    names = ("hrc_env.observations:_scale", "hrc_env.tracking.metrics:_measure_errors")
    some = [each for each in signatures.recorded("truth") if each.kernel in names]
    monkeypatch.setattr(signatures, "PATH", tmp_path / "signatures.json")
    signatures.write(some)
    cache.folder.cache_clear()
    yield some
    cache.folder.cache_clear()


@pytest.mark.parametrize("level", ["truth", "keypoints", "none"])
def test_everything_that_a_level_calls_is_recorded(level, process):
    done = process("-c", PLAY.format(level=level))
    assert done.returncode == 0, done.stderr
    called = {json.dumps(each) for each in json.loads(done.stdout.splitlines()[-1])}
    known = {json.dumps([each.kernel, each.args]) for each in signatures.recorded(level)}
    assert called <= known, "run python -m assets.kernels.record"


@pytest.mark.parametrize("level", ["truth", "keypoints", "none"])
def test_everything_that_the_first_step_calls_is_recorded_as_such(level, process):
    done = process("-c", PLAY_FIRST.format(level=level))
    assert done.returncode == 0, done.stderr
    called = {json.dumps(each) for each in json.loads(done.stdout.splitlines()[-1])}
    first = signatures.recorded(level + ahead.FIRST)
    assert called <= {json.dumps([each.kernel, each.args]) for each in first}
    assert {str(each) for each in first} < {str(each) for each in signatures.recorded(level)}


def test_only_what_the_first_step_calls_is_waited_for(two_kernels, monkeypatch):
    slow = [replace(each, seconds=60.0) for each in two_kernels]
    first, later = replace(slow[0], levels=["truth", "truth first"]), slow[1]
    signatures.write([first, replace(later, levels=["truth"])])
    started, compile_background = [], ahead._compile_in_background
    monkeypatch.setattr(ahead, "_compile_in_background", started.append)
    ahead.ensure.cache_clear()
    ahead.ensure("truth")
    assert first.is_compiled()
    assert not later.is_compiled()
    wait_until(lambda: started)
    assert [each.kernel for each in started[0]] == [later.kernel]
    compile_background(started[0])
    assert later.is_compiled()
    ahead.ensure.cache_clear()
    ahead.ensure("truth")
    assert len(started) == 1


def wait_until(holds, at_most_s=60.0):
    until_s = time.monotonic() + at_most_s
    while not holds():
        assert time.monotonic() < until_s
        time.sleep(0.01)


def test_two_processes_at_once_compile_everything_once(two_kernels):
    command = [sys.executable, "-c", SAY_WHAT_IS_DONE.format(path=str(signatures.PATH))]
    both = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    outputs = [each.communicate(timeout=120)[0].splitlines() for each in both]
    assert [each.returncode for each in both] == [0, 0]
    assert sorted(lines[-1] for lines in outputs) == ["0", "2"]
    assert ahead.missing() == []


def test_where_kernels_cannot_be_saved_no_process_compiles_them_in_vain(
    two_kernels, monkeypatch, tmp_path, capfd
):
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))
    cache.folder.cache_clear()
    monkeypatch.setattr(ahead, "n_cores", lambda: 1)
    told: list[float] = []
    ahead.compile_missing(None, lambda share, what: told.append(share))
    assert told == []
    assert "cannot be saved in" in capfd.readouterr().err


def test_what_is_missing_is_compiled_and_then_no_longer_missing(two_kernels):
    told: list[float] = []
    assert ahead.missing() == two_kernels
    assert ahead.compile_missing(None, lambda share, what: told.append(share)) == len(two_kernels)
    assert ahead.missing() == []
    assert sum(told) == pytest.approx(1.0)
    assert ahead.compile_missing(None, lambda share, what: told.append(share)) == 0


def test_where_no_process_can_be_started_it_says_so_and_goes_on(two_kernels, monkeypatch, caplog):
    monkeypatch.setattr(sys, "executable", "/nonexistent/python")
    with caplog.at_level(logging.WARNING):
        ahead.compile_missing(None, lambda share, what: None)
    assert "cannot be compiled in advance" in caplog.text
    assert ahead.missing() == two_kernels


def test_a_process_that_dies_is_named_and_its_kernel_left_for_later(
    two_kernels, monkeypatch, caplog
):
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with caplog.at_level(logging.WARNING):
        ahead.compile_missing(None, lambda share, what: None)
    assert "_scale" in caplog.text or "_measure_errors" in caplog.text
    assert ahead.missing() == two_kernels
