"""Robots begin apart from people."""

import numpy as np
import pytest
from gymnasium.utils import seeding

from hrc_env.core.errors import ConfigError
from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.motion import generator, starts
from hrc_env.settings import resolve_settings
from hrc_env.simulation import Simulation
from hrc_env.worker.body import worker_truth


class Room:
    """Robots on a line, each with a worker; draws go up by a decimetre, workers by a metre."""

    def __init__(self, monkeypatch, worker_m, step_m=0.1):
        self.worker_m, self.step_m = np.array(worker_m, float), step_m
        self.n_drawn, self.n_moved = np.zeros(len(worker_m), int), np.full(len(worker_m), -1)
        monkeypatch.setattr(starts.generator, "reset", lambda motion, ids, *rest: self.move(ids))
        monkeypatch.setattr(starts, "measure_gap_m", lambda ids, q, *rest: self.gap_m(ids, q))

    def draw(self, ids):
        self.n_drawn[ids] += 1
        return self.step_m * (self.n_drawn[ids, None] - 1.0)

    def move(self, ids):
        self.n_moved[ids] += 1
        self.worker_m[ids] += self.n_moved[ids] > 0

    def start(self):
        return starts.begin_apart(np.arange(len(self.worker_m)), self.draw, None, [], None, None)

    def gap_m(self, ids, q):
        return np.abs(self.worker_m[ids] - q[:, 0]) + 1e-9


def test_only_who_is_too_near_is_drawn_again(monkeypatch):
    room = Room(monkeypatch, [0.0, 5.0, 0.05])
    assert room.start()[:, 0] == pytest.approx([0.1, 0.0, 0.2])
    assert room.n_drawn.tolist() == [2, 1, 3]
    assert not room.n_moved.any()


def test_a_worker_who_leaves_no_room_is_drawn_again_and_if_nothing_helps_words_say_so(monkeypatch):
    stuck = Room(monkeypatch, [0.0], step_m=0.0)
    stuck.start()
    assert (stuck.n_drawn, stuck.n_moved) == (starts.ROBOT_TRIES + 2, 1)
    nowhere = Room(monkeypatch, [0.0], step_m=0.0)
    nowhere.gap_m = lambda ids, q: np.zeros(len(ids))
    with pytest.raises(ConfigError, match=r"No start with robot and workers 0.1 m apart"):
        nowhere.start()


@pytest.mark.parametrize("arguments", [{}, {"scene": "site", "n_workers": 2, "people": "hurried"}])
def test_no_robot_begins_within_a_decimetre_of_a_worker(arguments):
    simulation = Simulation(200, resolve_settings(perception="none", **arguments))
    simulation.reset(np.arange(200), [seeding.np_random(40 + b)[0] for b in range(200)])
    truth = worker_truth(simulation.bodies, generator.current(simulation.motion))
    arm = chains.capsules(simulation.chain, simulation.physics.q)
    radius_m = simulation.chain.capsule_radius_m
    gap_m = least_separation(arm, radius_m, truth.capsules_world, truth.capsule_radius_m).distance_m
    assert gap_m.min() >= starts.APART_M
    one = Simulation(1, resolve_settings(perception="keypoints", **arguments))
    for b in np.argsort(gap_m.min(1))[:20].tolist():
        one.reset(np.arange(1), [seeding.np_random(40 + b)[0]])
        np.testing.assert_array_equal(one.physics.q[0], simulation.physics.q[b])
