"""report.html and report.md: what was asked, done and found, and what it does not mean."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from hrc_env.core.provenance import provenance
from hrc_env.core.results import Metric
from hrc_env.experiments.impact.figures import plot_stops, plot_tax, plot_tradeoff
from hrc_env.experiments.impact.lateness import lateness_parts
from hrc_env.experiments.impact.measures import NOMINAL_MPS, Table
from hrc_env.experiments.impact.trial.eyes import REFERENCE, eyes_called, seeing
from hrc_env.experiments.impact.trial.policies import POLICIES, SLOWED
from hrc_env.experiments.impact.trial.tally import MOVING_MPS, SLOW_M, STOP_M
from hrc_env.experiments.impact.words import eyes_words
from hrc_env.experiments.study import page
from hrc_env.experiments.study.page import Part, Picture, Section, said
from hrc_env.tracking.estimators import ESTIMATORS

Metrics = Mapping[str, Metric]
ONE_CAMERA = seeing(n_cameras=1).name
_ROW_COLUMNS = (
    ("goals_per_min", "goals / min", 1), ("cost", "true cost", 1),
    ("separation_min_m", "least separation [m]", 3), ("contacts_towards", "contacts towards", 2),
    ("contacts_fleeing", "fleeing", 2), ("contacts_standing", "standing", 2),
    ("approaches", "approaches", 1), ("missed_stops", "missed stops", 1),
    ("false_stops", "false stops", 1), ("z_d_m", "Z_d [m]", 3), ("tax_m", "tax [m]", 2),
)  # fmt: skip
_DIFFERENCE_COLUMNS = (
    ("goals_per_min", "goals / min", 1), ("cost", "true cost", 1),
    ("separation_min_m", "least separation [m]", 3), ("contacts_towards", "contacts towards", 2),
    ("approaches", "approaches", 1), ("missed_stops", "missed stops", 1),
    ("false_stops", "false stops", 1),
)  # fmt: skip


def write_pages(
    out: Path, n_episodes: int, margins_m: Sequence[float], table: Table, metrics: Metrics
) -> None:
    """Figures, report.html and report.md into `out`."""
    policies = [name for name in POLICIES if (name, REFERENCE) in table]
    eyes = list(dict.fromkeys(name for _, name in table))
    figures = out / "figures"
    plot_tradeoff(figures / "tradeoff.png", metrics, policies, eyes)
    sections = [
        Section("What was asked", (_ASKED,)),
        Section("What was done", _done(n_episodes, table, policies)),
        Section("Throughput against true cost", _tradeoff(figures, metrics, policies, eyes)),
    ]
    if SLOWED in policies:
        plot_stops(figures / "stops.png", metrics, eyes)
        sections.append(Section("Wrong decisions", _stops(figures)))
    if plot_tax(figures / "tax.png", table, metrics, margins_m):
        sections.append(Section("What lateness costs", lateness_parts(figures, table, metrics)))
    sections += [
        Section(f"Beside {eyes_words(REFERENCE)}", _beside(metrics, policies, eyes)),
        Section("Every row", _every_row(metrics, policies, eyes)),
        Section("What it does not mean", _LIMITS),
    ]
    page.write_report(out, "What the eyes are worth", _lead(metrics, policies), sections)


_ASKED = (
    "A robot keeps away from a worker whom it knows through cameras only. What is a better "
    "estimator, one more camera or a shorter delay worth, in goals reached and in safety? Only the "
    "eyes are exchanged; robots, goals and workers stay the same."
)


def _done(n_episodes: int, table: Table, policies: Sequence[str]) -> tuple[Part, ...]:
    rows = sum(1 for policy, _ in table if policy in policies)
    seconds = 60 * table[policies[0], REFERENCE]["minutes"][0]
    return (
        f"{rows} rows (a policy with a pair of eyes) of {n_episodes} episodes of {seconds:.3g} s "
        "each, fewer where pixels are drawn, on the same seeds; commit "
        f'{provenance()["git"]}. Workers take no notice of the robot (`people="unaware"`), so '
        "that a seed's worker walks the same way in every row; this was checked, bit for bit. "
        "`scripted` drives straight to its goals at full speed whoever is near; `scripted_slowed` "
        f"slows down from {SLOW_M:g} m of estimated separation and stands still at {STOP_M:g} m; "
        "`ppo` was trained by this experiment on the default eyes with fixed seeds.",
        "Policies read observations, which hold the estimate. Everything below is counted on the "
        "true bodies. Cost: steps with less than 0.15 m of true separation, and steps in touch. "
        "Contacts a minute begin while the robot moves towards the touched worker at more than "
        f"{MOVING_MPS} m/s, flees, or neither (it stands, or slides along). Approaches: steps, "
        f"per 1,000, in which it moves towards a worker nearer than {STOP_M:g} m. Missed stops: "
        f"steps, per 1,000, in which the true separation is below {STOP_M:g} m and the believed "
        "one is not; false stops the other way round, for every policy, also for those that "
        "never stop. The distance is that at which `scripted_slowed` stands still (judgement); the "
        "protective distance of speed and separation monitoring would be longer, 0.65 m for a "
        "robot that stands (Marvel and Norcross 2017, PMC5117641, with 1.6 m/s, 0.1 s and 0.3 s), "
        "which here is undercut most of the time.",
        "Z_d: 95th percentile of the position error of all 15 joints in all steps, lost tracks "
        "included. Tax: Z_d of the same eyes on time + latency x (v_h + v_r), with "
        f"v_h = {NOMINAL_MPS} m/s (ISO 13855; verify against the standard before certification) "
        "and v_r the 95th percentile of the robot's speed towards the worker in that row. "
        "Intervals are 95 % bootstraps over episodes; the least separation is an interquartile "
        "mean, other numbers are means.",
        "Fewer than four cameras: the others fail after the first second, since a worker is "
        "acquired by two cameras that agree; which ones are left goes round from episode to "
        "episode. From the start: a rig of one camera, which never follows anybody, so that the "
        "robot is as blind as with `none`. Late images say when they were taken and the tracker "
        "predicts from there; not told ones claim to be new.",
    )


def _tradeoff(
    figures: Path, metrics: Metrics, policies: Sequence[str], eyes: Sequence[str]
) -> tuple[Part, ...]:
    shown = Picture(
        figures / "tradeoff.png",
        "A point for each pair of eyes, placed by its paired difference from the reference, whose "
        "95 % interval are the bars: up is more goals, left is safer. `scripted` does not look: "
        "all its points are one, and only its beliefs differ. Below: approaches instead of cost.",
    )
    said_ = [_WHOSE, *(_one_camera(metrics, policy) for policy in policies)]
    return (shown, *(words for words in said_ if words), *_estimators(metrics, policies))


_WHOSE = (
    "Cost counts nearness, whoever brought it about: a robot that stands still in a worker's way "
    "costs as much as one that comes nearer. Contacts towards and approaches say what the robot "
    "did."
)


def _one_camera(metrics: Metrics, policy: str) -> str:
    """What the last camera costs beside four, with intervals."""
    key = f"difference.{policy}.{ONE_CAMERA}"
    if f"{key}.cost" not in metrics:
        return ""
    cost, goals, touched, near, missed = (
        metrics[f"{key}.{what}"]
        for what in ("cost", "goals_per_min", "contacts_towards", "approaches", "missed_stops")
    )
    worse = [
        words
        for words, holds in (
            ("safety (true cost)", cost.low > 0),
            ("safety (contacts towards)", touched.low > 0),
            ("safety (approaches)", near.low > 0),
            ("throughput", goals.high < 0),
        )
        if holds
    ]
    verdict = (
        f"one camera costs {' and '.join(worse)}"
        if worse
        else "neither safety nor throughput tells one camera from four"
    )
    return (
        f"`{policy}`: {verdict}. Against four cameras, paired: cost {_signed(cost)}, contacts "
        f"towards {_signed(touched, 2)} a minute, approaches {_signed(near)} and missed stops "
        f"{_signed(missed)} per 1,000 steps, goals {_signed(goals)} a minute."
    )


def _estimators(metrics: Metrics, policies: Sequence[str]) -> tuple[str, ...]:
    """How far apart the estimators are with four cameras, for the policy that yields."""
    names = [seeing(each).name for each in ESTIMATORS if each != "particle"]
    key = f"difference.{SLOWED}"
    known = [name for name in names if f"{key}.{name}.cost" in metrics]
    if SLOWED not in policies or not known:
        return ()
    parts = [
        f"{eyes_called(name).estimator} cost {_signed(metrics[f'{key}.{name}.cost'])}, missed "
        f"stops {_signed(metrics[f'{key}.{name}.missed_stops'])}"
        for name in known
    ]
    return (f"Estimators with four cameras less `particle` (`{SLOWED}`): {'; '.join(parts)}.",)


def _stops(figures: Path) -> tuple[Part, ...]:
    return (
        Picture(
            figures / "stops.png", f"Decisions of `{SLOWED}` that the truth would make otherwise."
        ),
        "`truth` is not at zero: a robot that is given the true joints still thinks of the body "
        "as segments between them with radii, and the true body has other ones. What a pair of "
        "eyes adds to that is the eyes' share.",
    )


def _beside(metrics: Metrics, policies: Sequence[str], eyes: Sequence[str]) -> tuple[Part, ...]:
    """A table of paired differences for every policy."""
    parts: list[Part] = [
        "Differences on the same seeds, mean and 95 % interval; those whose interval leaves out "
        "zero have a dot."
    ]
    for policy in policies:
        rows = [
            (eyes_words(name), *(_dotted(metrics[f"{key}.{what}"], digits)
                                 for what, _, digits in _DIFFERENCE_COLUMNS))
            for name in eyes
            if f"{(key := f'difference.{policy}.{name}')}.cost" in metrics
        ]  # fmt: skip
        header = (policy, *(words for _, words, _ in _DIFFERENCE_COLUMNS))
        parts.append(page.Table(header, tuple(rows)))
    return tuple(parts)


def _every_row(metrics: Metrics, policies: Sequence[str], eyes: Sequence[str]) -> tuple[Part, ...]:
    """A table of everything for every policy."""
    header = tuple(words for _, words, _ in _ROW_COLUMNS)
    return tuple(
        page.Table(
            (policy, *header),
            tuple(
                (
                    eyes_words(name),
                    *(
                        said(metrics[f"{policy}.{name}.{what}"], digits=digits)
                        for what, _, digits in _ROW_COLUMNS
                    ),
                )
                for name in eyes
            ),
        )
        for policy in policies
    )


_LIMITS = (
    "Workers who never react are the harder case for a robot and the fair one for eyes; real "
    "people step back. Touches of a standing robot are then the worker's doing, and no eyes can "
    "prevent them.",
    "`scripted_slowed` uses the mean of the estimate and not its covariance: a policy that kept "
    "farther away when it knows less would turn one camera's missed stops into false ones. Shields "
    "come later.",
    "`keypoints` is an emulator of the detector. Its rows say what estimators make of such "
    "errors; the few episodes with `pixels` are a check, not a result.",
    "One laboratory, one robot, one worker, cameras in four corners, one trained policy from one "
    "seed: its place in the picture is not that of learning as such.",
)


def _lead(metrics: Metrics, policies: Sequence[str]) -> str:
    """The result in a paragraph."""
    policy = SLOWED if SLOWED in policies else policies[0]
    key = f"{policy}.{REFERENCE}"
    blind, seeing_ = metrics.get(f"{policy}.none.cost"), metrics[f"{key}.cost"]
    words = (
        f"`{policy}` with {eyes_words(REFERENCE)}: {said(metrics[f'{key}.goals_per_min'])} goals a "
        f"minute at a true cost of {said(seeing_)} an episode"
    )
    words += f"; blind, it would be {said(blind)}. " if blind is not None else ". "
    return words + " ".join(filter(None, [_one_camera(metrics, policy)]))


def _signed(metric: Metric, digits: int = 1) -> str:
    """A difference with its interval."""
    if metric.value != metric.value:
        return "-"
    value, low, high = (f"{v:+.{digits}f}" for v in (metric.value, metric.low, metric.high))
    return f"{value} ({low} to {high})"


def _dotted(metric: Metric, digits: int) -> str:
    return _signed(metric, digits) + (" ●" if metric.low > 0 or metric.high < 0 else "")
