"""Faults where there are images: nothing that a camera does stops an episode."""

import numpy as np
import pytest

from hrc_env.env import HRCEnv
from hrc_env.perception.faults.fault import KINDS, FaultConfig

pytestmark = pytest.mark.usefixtures("pixels")


def rolled(n_steps, *faults, seed=3, **kwargs):
    env = HRCEnv(perception="pixels", faults=faults, **kwargs)
    infos = [env.reset(seed=seed)[1], *(env.step(np.zeros(6))[4] for _ in range(n_steps))]
    env.close()
    return infos


def test_cameras_that_never_look_at_once_find_a_worker_together():
    rates = {"left": (6.0, 0.12, 2.6), "right": (5.0, 0.2, -2.6)}
    cameras = [
        {"name": name, "eye_world": (2.9, y, 2.45), "rate_hz": rate_hz, "latency_s": latency_s}
        for name, (rate_hz, latency_s, y) in rates.items()
    ]
    env = HRCEnv(cameras=cameras)
    env.reset(seed=0)
    for _ in range(14):
        env.step(np.zeros(6, np.float32))
    assert env.simulation.estimate.tracked.all()
    env.close()


def test_where_nobody_is_found_a_search_comes_only_now_and_then():
    env = HRCEnv(n_workers=1)
    searched = []

    def nobody(source, which):
        searched.extend([which] if which else [])
        return [[] for _ in env.simulation.scene.cameras]

    env.simulation.pipeline.worker_detector.pose_detector.search = nobody
    env.reset(seed=0)
    for _ in range(10):
        env.step(np.zeros(6, np.float32))
    assert len(searched) == 3  # at the reset, and 5 and 10 steps later
    env.reset(seed=1)
    assert len(searched) == 4
    env.close()


def test_every_fault_at_once_is_data():
    rolled(1, *(FaultConfig(kind, ("camera_1",)) for kind in KINDS if kind != "lost"))


def test_black_images_show_nobody():
    for fault in (FaultConfig("darkness", ("all",), 0.001), FaultConfig("lost", ("all",))):
        assert [info["tracking/lost"] for info in rolled(2, fault)] == [1.0] * 3


def test_a_frozen_lost_or_late_camera_leaves_the_others_tracking():
    faults = [
        FaultConfig("frozen", ("camera_1",), None, 0.12),
        FaultConfig("late", ("camera_2",), 0.08),
        FaultConfig("lost", ("camera_3",), None, 0.2),
    ]
    plain, spoilt = rolled(12), rolled(12, *faults)
    for name in ("safety/min_separation_m", "worker_0/activity"):
        assert [info.get(name) for info in plain] == [info.get(name) for info in spoilt]
    assert spoilt[-1]["tracking/mpjpe_m"] < 0.15


def test_a_slow_camera_with_an_open_shutter_and_a_late_one_are_used():
    slow = {"name": "a", "eye_world": [2.9, 2.6, 2.45], "rate_hz": 12.5, "exposure_s": 0.02}
    late = {"name": "b", "eye_world": [-2.9, 2.6, 2.45], "latency_s": 0.04}
    others = [(-2.9, -2.6, 2.45), (2.9, -2.6, 2.45)]  # camera_3 and camera_4
    assert rolled(8, cameras=[slow, late, *others])[-1]["tracking/mpjpe_m"] < 0.15
