"""What workers do near the robot, by the named choices of jobs."""

import numpy as np
import pytest

from benchmarks.work_mix import LOOKS, POSTURES, shares, watch
from hrc_env.motion import generator


@pytest.mark.parametrize(("jobs", "least", "most"), [("low_work", 0.05, 0.4), ("framing", 0, 0.02)])
def test_low_work_brings_folded_bodies_to_the_robot_and_framing_does_not(jobs, least, most):
    found = shares(watch(jobs, "lab", range(40)))
    assert least <= found["near.low"].value <= most
    assert 0.4 < found["near.time"].value < 0.9


def test_shares_are_of_the_time_that_is_counted():
    looks = np.zeros((4, 1), LOOKS)
    looks["separation_m"][:, 0] = 0.1, 0.2, 0.9, 0.9
    looks["posture"][:, 0] = POSTURES.index("kneeling"), 0, 0, POSTURES.index("folded")
    looks["activity"][:, 0] = generator.activity_names.index("kneel")
    found = {name: metric.value for name, metric in shares(looks).items()}
    assert (found["near.time"], found["near.kneeling"], found["near.folded"]) == (0.5, 0.5, 0.0)
    assert (found["all.low"], found["all.kneeling"], found["all.kneel"]) == (0.5, 0.25, 1.0)
