"""`python -m hrc_env bench` as people call it."""

from commands import hrc


def test_help_says_what_it_writes_and_how_long_it_takes():
    done = hrc("bench", "--help")
    assert done.returncode == 0
    for word in ("tracking", "--quick", "--out", "minutes", "results.json"):
        assert word in done.stdout


def test_an_unknown_bench_is_answered_with_the_known_ones():
    done = hrc("bench", "trakcing")
    assert done.returncode == 2
    assert "tracking" in done.stdout + done.stderr
    assert "Traceback" not in done.stderr
