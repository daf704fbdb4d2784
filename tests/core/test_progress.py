"""Progress in a terminal and in a log file, by a clock that the tests hold."""

import io

from rich.console import Console

from hrc_env.core.progress import Meter, progress_bar, track


class Clock:
    """Seconds that pass when the test says so."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def log() -> tuple[Console, io.StringIO]:
    file = io.StringIO()
    return Console(file=file, force_terminal=False, width=40), file


def test_a_log_file_gets_one_plain_line_every_ten_seconds():
    (console, file), clock = log(), Clock()
    with Meter(console, "training", 1_000_000, "steps", clock=clock) as meter:
        for second in range(1, 26):
            clock.now_s = second
            meter.show(10_000 * second, note="goals 12 %")
        lines = file.getvalue().splitlines()
    assert lines == [
        "training: 10 %, 100,000 of 1,000,000 steps, 0:00:10 passed, 0:01:30 left, goals 12 %",
        "training: 20 %, 200,000 of 1,000,000 steps, 0:00:20 passed, 0:01:20 left, goals 12 %",
    ]
    assert file.getvalue().splitlines()[-1].startswith("training: 25 %")


def test_what_is_short_says_nothing_in_a_log_file():
    (console, file), clock = log(), Clock()
    with Meter(console, "drawing", clock=clock) as meter:
        clock.now_s = 9.9
        meter.show(1.0)
    assert file.getvalue() == ""


def test_time_left_counts_what_was_done_since_it_went_on():
    """One percent in 20 s: the nine that are left take 180 s, whoever did the first ninety."""
    (console, file), clock = log(), Clock()
    with Meter(console, "training", 100, "steps", done=90, clock=clock) as meter:
        clock.now_s = 10.0
        meter.show(90)
        clock.now_s = 20.0
        meter.show(91)
    assert "? left" in file.getvalue().splitlines()[0]
    assert "0:00:20 passed, 0:03:00 left" in file.getvalue().splitlines()[1]


def test_a_terminal_gets_a_bar_that_counts():
    file = io.StringIO()
    console = Console(file=file, force_terminal=True, width=140)
    with Meter(console, "training", 200, "steps") as meter:
        meter.show(200, note="goals 50%")
    for word in ("training", "100 %", "200 of 200 steps", "left", "goals 50%"):
        assert word in file.getvalue()


def test_values_pass_through_a_track():
    console, _ = log()
    assert list(track((k for k in "abc"), "letters", total=3, console=console)) == list("abc")
    assert list(track([1, 2], "numbers", console=console)) == [1, 2]


def test_shares_that_are_told_add_up():
    file = io.StringIO()
    console = Console(file=file, force_terminal=True, width=140)
    with progress_bar(console, "bench") as say:
        say(0.25, "one")
        say(0.5, "two")
    assert "two" in file.getvalue()
    assert " 75 %" in file.getvalue()
