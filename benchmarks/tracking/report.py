"""The report of the tracking benchmark."""

from collections.abc import Mapping, Sequence
from itertools import product

from benchmarks.common import format_number
from benchmarks.tracking.declaration import BENCH, KINDS, table_of_kind, times
from benchmarks.tracking.env_sequences import ENV
from benchmarks.tracking.names import DEFAULT, DLT, EVERYTHING, SMOOTHER, Selection
from benchmarks.tracking.sequences import MATCHED, TWO_WORKERS
from hrc_env.experiments.report import Metrics, Report, format_table

_LEAD = f"""\
Numbers in brackets are 95 % bootstrap intervals over sequences. `lab` and `site` are
simulated walkers with independent detection errors of 3 px; `{ENV}` is the environment's worker
through the emulator. `hard` has occlusion, gross errors and exchanged sides. In `drifting`,
detection errors last half a second, which estimators do not model. In `late`, images arrive 40 to
220 ms late, one camera has half the frame rate, and one image in twenty is lost. `one_camera_...`
are the first half second, second and two seconds of the four in which one camera remains;
`after_return` begins a second after the other cameras have returned. `{DLT}` is linear
triangulation of each frame; `{SMOOTHER}` knows the whole clip and is not compared."""
_ABOUT_THE_BOUND = """\
`matched` bodies move as in the estimators' motion model, without bones. Estimators are configured
accordingly (no outliers, no exchanged sides, correct noise of detections, unknown bone lengths),
but still learn the joints' positions on the body. The bound is the mean over the sequences."""


def report(metrics: Metrics, selection: Selection = EVERYTHING) -> Report:
    """Return the report, without sections that have no results."""
    rivals = [DEFAULT, *selection.rivals()]
    with_names = [name for name in rivals if name != DLT]
    swaps = {"": f"identity_swaps.{{rig}}.{TWO_WORKERS}.{{name}}"}
    sections = [(f"{DEFAULT}, the default, and the best of the others", _lead(metrics, selection))]
    if rigs := selection.rigs_of(MATCHED):
        bound = f"{_bound(metrics, selection, rigs)}\n\n{_ABOUT_THE_BOUND}"
        sections.append(("RMSE / posterior Cramer-Rao bound", bound))
    if rigs := selection.rigs_of(TWO_WORKERS):
        title = "Two workers: changes of identity per 100 sequences"
        sections.append((title, _by_rig(metrics, with_names, rigs, swaps)))
    parts = [part for title, text in sections if text for part in (f"## {title}", text)]
    names = list(dict.fromkeys(n for _, c in selection.conditions() for n in selection.names_of(c)))
    shown = [times(selection.timed()).to_markdown(metrics)]
    for each in (BENCH, *(table_of_kind(kind, names, selection) for kind in KINDS)):
        shown.append(each.to_markdown(metrics, intervals=False))
    spread = "95 % intervals over seeds, times with the smallest and the largest"
    return Report(
        "Estimators on simulated sequences", _LEAD, [*parts, *filter(None, shown)], spread
    )


def _lead(metrics: Metrics, selection: Selection) -> str:
    """Return a table of the default estimator, the paper's algorithm and the best other one."""
    lines, rivals = list[list[str]](), selection.rivals()
    header = ["", "RMSE, cm", "coverage", "std/RMSE"]
    header += ["paper, cm"] if "paper" in rivals else []
    header += ["best other, cm", "default/best"] if rivals else []
    for rig, _, window in selection.rows():
        key = f"{rig}.{window}"
        line = [
            f"{rig} {window}",
            format_number(metrics[f"rmse_m.{key}.{DEFAULT}"], 100, 2, True),
            format_number(metrics[f"coverage95.{key}.{DEFAULT}"], 1, 3),
            format_number(metrics[f"std_over_rmse.{key}.{DEFAULT}"], 1, 2),
        ]
        if "paper" in rivals:
            line.append(format_number(metrics[f"rmse_m.{key}.paper"], 100, 2))
        if rivals:
            best = min(rivals, key=lambda name: metrics[f"rmse_m.{key}.{name}"].value)
            line.append(f"{format_number(metrics[f'rmse_m.{key}.{best}'], 100, 2)} {best}")
            line.append(format_number(metrics[f"default_over.{key}.{best}"], 1, 3, True))
        lines.append(line)
    return format_table(header, lines)


def _by_rig(
    metrics: Metrics,
    names: Sequence[str],
    rigs: Sequence[str],
    kinds: Mapping[str, str],
    *above: list[str],
) -> str:
    """Return a table with one row per rig and title, and one column per estimator.

    Args:
        metrics: metrics by name.
        names: names of the estimators.
        rigs: names of the rigs.
        kinds: patterns of the metrics' names, by title.
        above: additional rows at the top of the table.
    """
    lines = list(above)
    for rig, (title, key) in product(rigs, kinds.items()):
        scale, digits = (100, 2) if key.startswith("rmse_m") else (1, 3)
        found = (metrics.get(key.format(rig=rig, name=name)) for name in names)
        lines.append([rig + title, *(format_number(each, scale, digits, True) for each in found)])
    return format_table(["", *names], lines)


def _bound(metrics: Metrics, selection: Selection, rigs: Sequence[str]) -> str:
    names = selection.names_of(MATCHED)
    both = [
        "both rigs",
        *(format_number(metrics[f"ratio_to_bound.{name}"], 1, 3, True) for name in names),
    ]
    kinds = {
        "": "ratio_to_bound_in.{rig}.{name}",
        ": coverage": f"coverage95.{{rig}}.{MATCHED}.{{name}}",
    }
    return _by_rig(metrics, names, rigs, kinds, *([both] if len(rigs) > 1 else []))
