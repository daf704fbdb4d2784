"""How tracks begin, in the bench's smallest form."""

from benchmarks.tracking.rigs import make_rig
from benchmarks.tracking.starts import DESIGNS, STARTS, WINDOWS, locks, one_view


def test_algorithm_1_locks_on_in_every_design():
    metrics = locks(make_rig("lab"), [1, 2])
    for design in DESIGNS:
        assert metrics[f"locks.lab.{design}"].value == 1.0
        assert 1 <= metrics[f"frames.lab.{design}"].value <= 5


def test_one_view_is_worse_than_all_and_all_make_it_good():
    metrics = one_view(make_rig("lab"), [1, 2])
    assert len(metrics) == 3 * len(WINDOWS) * len(STARTS)
    alone, again = (metrics[f"rmse_m.lab.{w}.one_camera"].value for w in list(WINDOWS)[1:])
    assert again < 0.05 < alone
