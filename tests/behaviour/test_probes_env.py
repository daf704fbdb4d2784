"""Nothing behaves otherwise than recorded."""

import pytest

from tests.behaviour.rooms import check, probes

ROOMS = ("env", "agents", "learning")
PLACED = {each.label: each for each in probes(ROOMS)}


@pytest.mark.parametrize(
    "label",
    [
        pytest.param(label, marks=[] if each.probe.is_short else pytest.mark.slow)
        for label, each in PLACED.items()
    ],
)
def test_behaves_as_recorded(label):
    assert [str(each) for each in check(PLACED[label])] == []
