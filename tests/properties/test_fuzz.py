"""The fuzz finds an estimator that is surely wrong, and not one that says that it does not know."""

import fuzzed
import numpy as np
import pytest
from figures import Figure, count

FRESH = range(490_000, 490_300)
"""Cases that nothing was chosen on; bounds come from cases 0 to 1999."""

CURED = (189, 208, 223, 241, 306, 335, 387, 460, 605, 775, 995, 1120, 1132,
         1521)  # fmt: skip
"""Cases of the first 100,000 sequences in which much was surely wrong, or not recovered: rigs of
two cameras (387: of six) of which one hangs askew. `fuzzed.judge(605)` draws one again."""
KNOWN: dict[int, dict[str, set[int]]] = {
    118: {"surely_wrong": {33}},
    **{
        case: {"not_recovered": set(sequences)}
        for case, sequences in {
            446: (3, 19, 21, 23), 467: (12,), 480: (36,), 581: (36,), 670: (2,), 705: (21,),
            910: (1, 31), 917: (10,), 962: (22, 31), 1085: (19,), 1146: (4, 25), 1201: (22,),
            1240: (16,), 1428: (24,), 1567: (49,), 1581: (22,),
            1671: (35,), 1848: (16, 40), 1945: (44,),
        }.items()
    },
}  # fmt: skip
"""What is still wrong in the same 100,000: surely, where for more than a second one camera alone
that hangs askew shows somebody; not recovered, mostly where one of two others is believed with it.
"""


def test_a_case_is_reproduced_and_nothing_is_wrong_with_it():
    rigs = [fuzzed.draw_rig(np.random.default_rng([3, 11])) for _ in range(2)]
    np.testing.assert_array_equal(rigs[0][1], rigs[1][1])
    assert np.abs(rigs[0][0].P - rigs[0][1]).max() > 0  # cameras hang a little otherwise
    assert fuzzed.judge(3) == []


def _found(case):
    found = fuzzed.judge(case)
    return {kind: {k for each, k in found if each == kind} for kind in dict(found)}


@pytest.mark.parametrize("case", CURED)
def test_nothing_is_wrong_any_more_with_a_case_that_was_found(case):
    assert _found(case) == {}


@pytest.mark.long
@pytest.mark.parametrize("case", KNOWN)
def test_what_is_known_to_be_wrong_does_not_grow(case):
    found, known = _found(case), KNOWN[case]
    assert found.keys() <= known.keys()
    assert all(found[kind] <= known[kind] for kind in found)


def test_people_are_shaken_by_what_is_said_at_most():
    still = np.zeros((fuzzed.N_FRAMES, 200, 15, 3))
    shaken = fuzzed.shake(np.random.default_rng(0), still)
    acceleration = np.linalg.norm(np.diff(shaken[:, :, 0], 2, axis=0), axis=-1) / 0.04**2
    assert 30 < np.percentile(acceleration.max(0), 95) < 90  # its envelope adds a little
    np.testing.assert_allclose(shaken[-1], 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("off_m", "std_m", "kinds"),
    [(0.0, 0.01, set()), (2.0, 1.0, {"not_recovered"}),
     (2.0, 0.01, {"surely_wrong", "not_recovered"}), (np.nan, 0.01, {"not_finite"})],
)  # fmt: skip
def test_what_is_wrong_is_called_by_its_name(off_m, std_m, kinds, monkeypatch):
    rng, seeds = np.random.default_rng(5), [1, 2]
    rig, P = fuzzed.draw_rig(rng)
    joints = fuzzed.walk((0.5, 0.5), seeds, fuzzed.N_FRAMES)
    px = fuzzed.detect(P, joints, fuzzed.Damage(), seeds)

    def beliefs(*_):
        for joints_now in joints:
            mean = joints_now[:, None] + off_m
            yield mean, np.broadcast_to(std_m**2 / 3 * np.eye(3), (*mean.shape, 3))

    monkeypatch.setattr(fuzzed, "beliefs", beliefs)
    assert {kind for kind, _ in fuzzed.find_faults(rig, joints, px, seeds)} == kinds


def test_an_exception_is_counted(monkeypatch, capsys):
    monkeypatch.setattr(fuzzed, "beliefs", lambda *_: 1 / 0)
    assert fuzzed.judge(0) == [("exceptions", -1)]
    assert "ZeroDivisionError" in capsys.readouterr().err


@pytest.mark.long
def test_faults_are_rare_on_fresh_rigs_and_motions(figures):
    """Intervals of faults are over cases, as the 50 sequences of a rig are not independent."""
    found = [_found(case) for case in FRESH]
    n_sequences = fuzzed.EACH * len(FRESH)
    lost = sum(len(case.get("exceptions", ())) * fuzzed.EACH for case in found)
    lost += sum(len(case.get("not_finite", ())) for case in found)
    cases = {kind: count(sum(kind in case for case in found), len(found)) for kind in fuzzed.KINDS}
    figures.hold(
        Figure("fuzz.no_number.sequences", count(lost, n_sequences), most=0.001),
        Figure("fuzz.surely_wrong.cases", cases["surely_wrong"], most=0.025),
        Figure("fuzz.not_recovered.cases", cases["not_recovered"], most=0.05),
    )
