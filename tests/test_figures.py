"""Figures of tests: exact intervals, bounds on whole intervals, one table."""

import json
from types import SimpleNamespace

import pytest
from figures import Figure, Figures, collect, count, write

from hrc_env.core.results import Metric


def test_no_event_in_a_hundred_trials_has_an_upper_limit():
    metric = count(0, 100)
    assert (metric.value, metric.low, metric.n) == (0.0, 0.0, 100)
    assert metric.high == pytest.approx(1 - 0.025**0.01)


@pytest.mark.parametrize(
    ("least", "most", "is_held"),
    [(None, None, True), (1.0, 3.0, True), (1.1, None, False), (None, 2.9, False)],
)
def test_a_bound_is_for_the_whole_interval(least, most, is_held):
    assert Figure("a", Metric(2.0, 1.0, 3.0, "m", 5), least, most).is_held() is is_held
    assert not Figure("a", Metric(*[float("nan")] * 3, "m", 0), least, most).is_held()


def test_all_figures_of_a_test_are_noted_before_it_fails(tmp_path):
    properties: list[tuple[str, object]] = []
    low, high = Figure("b.low", count(1, 50), most=0.01), Figure("a.high", count(49, 50), 0.5)
    with pytest.raises(AssertionError, match=r"b\.low.*at most 0\.01"):
        Figures(properties).hold(low, high)
    report = SimpleNamespace(when="call", user_properties=properties)
    lines = write(collect([report, SimpleNamespace(when="setup")]), tmp_path / "figures.json")
    assert [line.split()[0] for line in lines] == ["a.high", "b.low"]
    kept = json.loads((tmp_path / "figures.json").read_text())
    assert kept["b.low"]["most"] == 0.01
    assert kept["a.high"]["metric"]["n"] == 50
