"""What of a machine a process may use."""

import os

from hrc_env.core import machine


def test_a_containers_limits_count(monkeypatch, tmp_path):
    monkeypatch.setattr(machine, "CGROUP", tmp_path)
    cores, memory_gb = machine.usable_cores(), machine.usable_memory_gb()
    assert 1 <= cores <= (os.cpu_count() or 1)
    (tmp_path / "cpu.max").write_text("50000 100000\n")
    (tmp_path / "memory.max").write_text("512000000\n")
    assert machine.usable_cores() == 0.5
    assert machine.n_cores() == 1
    assert machine.usable_memory_gb() == 0.512
    (tmp_path / "cpu.max").write_text("max 100000\n")
    (tmp_path / "memory.max").write_text("max\n")
    assert (machine.usable_cores(), machine.usable_memory_gb()) == (cores, memory_gb)


def test_an_unreadable_limit_is_no_limit(monkeypatch, tmp_path):
    monkeypatch.setattr(machine, "CGROUP", tmp_path / "none")
    assert machine.n_cores() >= 1
