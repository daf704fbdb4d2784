"""Engines on this machine: the same parts wherever they are played; what dies is begun again."""

import os
import pickle
import socket
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from calls import STUDY, cores, die, die_once, fail, parts_of

import hrc_env
from hrc_env import make_agent, run_experiment
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.engines import cluster
from hrc_env.engines.engine import engine_called
from hrc_env.engines.files import CarriedFile, carried, carried_to
from hrc_env.engines.local import ATTEMPTS, Processes, Serial
from hrc_env.evaluation.episodes import play_shards
from hrc_env.experiments.cache import Part, PartCache


@pytest.mark.slow
def test_parts_do_not_depend_on_the_engine(tmp_path):
    for name in ("serial", "processes"):
        run_experiment(STUDY, tmp_path / name, engine=engine_called(name))
    assert parts_of(tmp_path / "serial") == parts_of(tmp_path / "processes")
    assert len(parts_of(tmp_path / "serial")) == 5
    tables = [(tmp_path / name / "report.md").read_text() for name in ("serial", "processes")]
    assert tables[0] == tables[1]


@pytest.mark.slow
def test_scores_do_not_depend_on_the_engine():
    asked = {"task": "HRCReach-v0", "max_episode_steps": 8, "perception": "keypoints"}
    make = partial(make_agent, "random")
    one, many = (play_shards(make, 66, 5, each, **asked) for each in (Serial(), Processes(2)))
    np.testing.assert_equal(one, many)
    assert len(one) == 66


@pytest.mark.slow
def test_processes_compute_on_one_core_each_and_what_dies_is_begun_again(tmp_path):
    cache = PartCache(tmp_path, "key", 3, lambda share, label: None, engine=Processes(2))
    flag = tmp_path / "died"
    asked = [Part("one", cores), Part("dies", partial(die_once, flag)), Part("two", cores)]
    found = cache.make_parts(asked)
    assert flag.exists()
    assert [each["cores"] for each in (found[0], found[2])] == [1, 1]
    assert os.getpid() not in {each["pid"] for each in (found[0], found[2])}
    assert found[1] == {"died": True}
    assert "HRC_ENV_CORES" not in os.environ


@pytest.mark.slow
def test_workers_end_with_a_process_that_is_killed(tmp_path):
    pids = tmp_path / "pids"
    script = (
        "import os, sys, time\n"
        "from hrc_env.engines.local import Processes\n"
        "def work(tick):\n"
        "    open(sys.argv[1], 'a').write(f'{os.getpid()} ')\n"
        "    time.sleep(600)\n"
        "if __name__ == '__main__':\n"
        "    list(Processes(2).run([work, work], print))"
    )
    path = tmp_path / "script.py"
    path.write_text(script)
    with subprocess.Popen([sys.executable, path, pids]) as parent:
        while not pids.exists() or len(pids.read_text().split()) < 2:
            time.sleep(0.1)
        parent.kill()
    for pid in map(int, pids.read_text().split()):
        for _ in range(600):
            if not Path(f"/proc/{pid}").exists():
                break
            time.sleep(0.1)
        assert not Path(f"/proc/{pid}").exists()


@pytest.mark.slow
def test_a_worker_that_dies_again_and_again_ends_it_and_what_is_done_is_kept(tmp_path):
    cache = PartCache(tmp_path, "key", 2, lambda share, label: None, engine=Processes(1))
    with pytest.raises(HRCError, match=rf"died {ATTEMPTS} times before call 2 of 2"):
        cache.make_parts([Part("one", cores), Part("dies", die)])
    assert (tmp_path / "one.json").exists()
    assert not (tmp_path / "dies.json").exists()


@pytest.mark.slow
def test_errors_of_ours_come_back_as_they_are():
    with pytest.raises(ConfigError, match="this cannot be"):
        list(Processes(1).run([fail], lambda k, share: None))


def test_parts_that_are_there_are_not_played_again(tmp_path):
    shares = []
    cache = PartCache(
        tmp_path, "key", 2, lambda share, label: shares.append(share), engine=Serial()
    )
    first = cache.make_parts([Part("one", cores)])
    again = cache.make_parts([Part("one", fail), Part("two", cores)])
    assert again[0] == first[0]
    assert sum(shares) == pytest.approx(1.5)
    replaced = replace(cache, key="other")
    with pytest.raises(ConfigError):
        replaced.make_parts([Part("one", fail)])


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (("ry",), "Did you mean 'ray'"),
        (("processes", 0), "workers must be a whole number from 1"),
        (("serial", 2), "requires --engine processes or --engine ray"),
        ((None, 2), "requires --engine processes or --engine ray"),
        (("processes", 2, "auto"), "--address requires --engine ray"),
    ],
)
def test_engines_that_cannot_be_are_answered_in_words(asked, said):
    with pytest.raises(ConfigError, match=said):
        engine_called(*asked)


def test_files_travel_with_their_paths(tmp_path):
    path = tmp_path / "policy.zip"
    path.write_bytes(b"weights")
    travelling = pickle.dumps(carried(str(path)))
    assert pickle.loads(travelling) == str(path)  # where it is there, it is that one
    path.write_bytes(b"others")
    placed = pickle.loads(travelling)
    assert placed != str(path)
    assert Path(placed).read_bytes() == b"weights"
    path.unlink()
    assert pickle.loads(travelling) == placed
    assert isinstance(carried_to(placed, b"weights"), CarriedFile)
    assert type(carried("scripted")) is str


def test_evaluate_takes_an_engine_by_name():
    with pytest.raises(ConfigError, match="Did you mean 'serial'"):
        hrc_env.evaluate("scripted", 1, engine="serail")


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("", 0))
        return found.getsockname()[1]


def test_clusters_that_are_not_there_are_said_at_once(monkeypatch):
    monkeypatch.setattr(cluster.ray, "init", None)  # which would try for minutes
    for address, said in (
        (f"localhost:{free_port()}", "start one with `ray start --head`"),
        ("ray://localhost:1", "start one with `ray start --head`"),
        ("somewhere", "must be auto, HOST:PORT or ray://HOST:PORT"),
    ):
        with pytest.raises(ConfigError, match=said), cluster.connected(address):
            pass
