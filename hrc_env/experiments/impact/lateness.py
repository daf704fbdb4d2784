"""The report's section about late eyes: metres as predicted and as measured."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from hrc_env.core.results import Metric
from hrc_env.experiments.impact.measures import NOMINAL_MPS, Table
from hrc_env.experiments.impact.tax import MEASURED
from hrc_env.experiments.impact.trial.eyes import LATE, Eyes
from hrc_env.experiments.impact.trial.policies import SLOWED
from hrc_env.experiments.impact.trial.tally import SLOW_M
from hrc_env.experiments.impact.words import eyes_words
from hrc_env.experiments.study import page
from hrc_env.experiments.study.page import Part, Picture, said

Metrics = Mapping[str, Metric]
AGREES = 0.3
"""The tax predicts what lateness costs if measured metres are within this share of it."""
_COLUMNS = (
    ("nominal_m", f"latency x ({NOMINAL_MPS} m/s + v_r)"),
    ("speeds_here_m", "latency x (v_h + v_r)"),
    ("squares_m", "as squares"), ("belief_m", "measured in the belief"),
    ("margin_m", "measured as a margin"),
)  # fmt: skip


def lateness_parts(figures: Path, table: Table, metrics: Metrics) -> tuple[Part, ...]:
    """The table of predicted and measured metres, and what follows."""
    late = [eyes for eyes in LATE if (SLOWED, eyes.name) in table]
    rows = tuple(
        (
            eyes_words(eyes.name),
            *(said(metrics[f"lateness.{eyes.name}.{how}"], digits=3) for how, _ in _COLUMNS),
        )
        for eyes in late
    )
    return (
        Picture(
            figures / "tax.png",
            "Left: the share of stops that are missed falls as distances grow. Right: metres that "
            "lateness costs, as predicted (grey) and as measured.",
        ),
        "The tax of late eyes is that of the same eyes on time and latency x (v_h + v_r). The "
        "extra metres were measured in two ways: by how much the 95th percentile of believed less "
        f"true gap grows where the true gap is below {SLOW_M:g} m; and as the margin that "
        f"`{SLOWED}` must add to its distances until it misses no greater share of the stops that "
        "the truth calls for than with eyes on time.",
        page.Table(("eyes [m]", *(words for _, words in _COLUMNS)), rows),
        *(_agreement(metrics, late, how) for how in ("nominal_m", "speeds_here_m", "squares_m")),
        _WHY_NOT,
        *_told(metrics, late),
    )


_WHY_NOT = (
    "Why a sum predicts too much: (1) 1.6 m/s is a walking body that comes straight at the "
    "robot; workers here reach and turn beside it, and their speed towards it is far lower. "
    "(2) v_r does not count for a robot that measures the gap from its own encoders, which are not "
    "late: only the worker's place is old. (3) Percentiles of independent errors do not add; their "
    "squares do, nearly. The tax is therefore what a standard has to demand, a bound for the worst "
    "case, and no estimate of what lateness costs here."
)


def _agreement(metrics: Metrics, late: Sequence[Eyes], how: str) -> str:
    """Measured over predicted metres, and whether that is within `AGREES`."""
    shares = [
        metrics[f"lateness.{eyes.name}.{measured}"].value
        / metrics[f"lateness.{eyes.name}.{how}"].value
        for eyes in late
        for measured in MEASURED
    ]
    agree = sum(abs(share - 1) <= AGREES for share in shares)
    words = dict(_COLUMNS)[how]
    return (
        f"Measured over predicted, `{words}`: {min(shares):.2f} to {max(shares):.2f}; within "
        f"{100 * AGREES:.0f} % in {agree} of {len(shares)} cases (eyes and way to measure)."
    )


def _told(metrics: Metrics, late: Sequence[Eyes]) -> tuple[str, ...]:
    """What it helps that images say when they were taken: Z_d, and margins."""
    said_ = []
    for told in (eyes for eyes in late if eyes.is_told):
        twin = next((e for e in late if not e.is_told and e.latency_s == told.latency_s), None)
        if twin is not None:
            errors, margins = (
                [metrics[key.format(eyes.name)] for eyes in (told, twin)]
                for key in (f"{SLOWED}.{{}}.z_d_m", "lateness.{}.margin_m")
            )
            said_.append(
                f"{1000 * told.latency_s:.0f} ms: Z_d {said(errors[0], digits=3)} m told, "
                f"{said(errors[1], digits=3)} m not told; margins {said(margins[0], digits=3)} m "
                f"and {said(margins[1], digits=3)} m."
            )
    if not said_:
        return ()
    return (
        "Does it help to be told the delay, so that the tracker predicts over it? "
        + " ".join(said_)
        + " Where Z_d shrinks and the margin does not, predictions are nearer to the joints on "
        "the whole, and may overshoot where hands turn back at the robot.",
    )
