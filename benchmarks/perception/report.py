"""The perception bench as people read it: Markdown tables, and plots beside them."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.perception.plots import plot_faults, plot_speed, plot_views
from benchmarks.perception.speed import REST, STAGES
from benchmarks.perception.views import ROWS
from hrc_env.core.provenance import provenance
from hrc_env.core.results import Metric
from hrc_env.perception.faults.fault import IMAGE, KINDS, PLACE

_Metrics = Mapping[str, Metric]
PLACE_KINDS = tuple(kind for kind, each in KINDS.items() if each.group == PLACE)


def write_report(out: Path, metrics: _Metrics) -> None:
    """Write perception.md, speed.png, detection.png and faults.png into `out`."""
    (out / "perception.md").write_text(markdown(metrics))
    plot_speed(out / "speed.png", metrics)
    plot_views(out / "detection.png", metrics)
    plot_faults(out / "faults.png", metrics)


def markdown(metrics: _Metrics) -> str:
    """All tables."""
    made = provenance()
    blocks = [
        "# Perception bench",
        f"Commit {made['git']}, {made['machine']['cores']} cores. 95 % intervals in brackets: by "
        "resampling episodes or crops, of shares Wilson's. Level `pixels` unless it says "
        "otherwise; every camera looks in every step.",
        "## Speed",
        _speed(metrics),
        "## Error of the estimate",
        _loops(metrics),
        "The arm rests. Errors are of single joints in 3D while the worker is tracked; coverage is "
        "the share of joints inside the reported 95 % region, and the deviation that is reported "
        "is set beside the root mean square of the error. Rows by pose are of all scenes.",
        "## Faults of one of four cameras, lab",
        fault_table(metrics),
        "The cameras have the fault in turns, all the time. The ratio is that of median errors "
        "with and without it on the same seeds; p95 is the 95th percentile. `keypoints` knows no "
        "faults of images.",
        "Median error with one camera lost, over that with all of them: " + _lost(metrics) + ".",
        "## Cameras named as miscalibrated",
        _named(metrics),
        "Share of episodes in which the camera with the fault is named in "
        '`info["perception/miscalibrated"]`, after how long (the median, where it is), and the '
        "share of steps in which another one is.",
        "## Single crops, looked at as if for the first time",
        _views(metrics),
        "Crops round the true joints with the whole worker in view. Errors are mean distances of a "
        "crop's joints from the truth in the image, in % of stature.",
        "## The emulator beside the pixels",
        _emulator(metrics),
        "Error of the estimate at `keypoints` over that at `pixels`, on clips and viewpoints that "
        "the emulator's calibration has not seen, by family of motions "
        "(`assets.emulator`).",
        "## Nobody there",
        f"{metrics['phantom_frames'].value:.0f} of {metrics['phantom_frames'].n} images of empty "
        f"scenes were said to show somebody; {metrics['phantom_tracks'].value:.0f} steps had a "
        "track.",
    ]
    return "\n\n".join(blocks) + "\n"


def fault_table(metrics: _Metrics) -> str:
    """A row for every fault; also what docs/perception_and_estimators.md shows."""
    lines = []
    kinds = [kind for kind in KINDS if f"error_ratio.{kind}" in metrics]
    for kind in ("none", *kinds):
        lines.append([f"`{kind}`" if kind != "none" else "no fault", *_fault_row(metrics, kind)])
    return _table(
        ["", "ratio", "median [mm]", "p95 [mm]", "coverage", "std/error", "seen by it",
         "`keypoints`: ratio", "p95 [mm]", "coverage", "std/error"],
        lines,
    )  # fmt: skip


def _fault_row(metrics: _Metrics, kind: str) -> list[str]:
    cells = []
    for start in ("", "keypoints."):
        if start and kind in KINDS and KINDS[kind].group == IMAGE:
            cells += ["-"] * 4
            continue
        coverage = "fault.none" if kind == "none" else kind
        ratio = metrics.get(f"{start}error_ratio.{kind}")
        cells.append("" if ratio is None else _cell(ratio, 1, 2, True))
        if not start:
            cells.append(_cell(metrics[f"error_m.fault.{kind}.median"], 1000, 1))
        cells.append(_cell(metrics[f"{start}error_m.fault.{kind}.p95"], 1000, 0))
        cells.append(_cell(metrics[f"{start}coverage95.{coverage}"], 1, 2))
        cells.append(_cell(metrics[f"{start}std_over_error.fault.{kind}"], 1, 2))
        if not start:
            seen = metrics.get(f"detected.fault.{kind}")
            cells.append("" if seen is None else _cell(seen, 100, 0) + " %")
    return cells


def _named(metrics: _Metrics) -> str:
    """What `perception/miscalibrated` says where there is something to say."""
    lines = []
    for kind in ("none", *KINDS):
        cells, told = [], False
        for start in ("", "keypoints."):
            key = f"{start}miscalibrated.{kind}"
            if f"{key}.named" not in metrics:
                cells += ["-"] * 3
                continue
            named, others = metrics[f"{key}.named"], metrics[f"{key}.others"]
            after = metrics[f"{key}.after_s"]
            told |= named.value > 0 or others.value > 0
            seconds = _cell(after, 1, 1) if after.n else ""
            cells += [f"{named.value * named.n:.0f} of {named.n}", seconds]
            cells += [_cell(others, 100, 1) + " %"]
        if told or kind in ("none", *PLACE_KINDS):
            lines.append([f"`{kind}`" if kind != "none" else "no fault", *cells])
    header = ["", "named", "after [s]", "others", "`keypoints`: named", "after [s]", "others"]
    return _table(header, [line for line in lines if set(line[1:]) != {"-"}])


def _speed(metrics: _Metrics) -> str:
    lines = []
    for key in _keys(metrics, "steps_per_s."):
        cameras, workers, *special = key.split(".")
        ms = [metrics[f"stage_ms.{stage}.{key}"] for stage in (*STAGES, REST)]
        rate = f"{metrics[f'steps_per_s.{key}'].value:.1f}"
        cells = (_cell(each, 1, 1) for each in ms)
        lines.append([cameras, workers, " ".join(special), rate, *cells])
    header = ["cameras", "workers", "", "steps a second", *(f"{s} [ms]" for s in (*STAGES, REST))]
    said = (
        "Steps a second are of the median step; the milliseconds of each stage were taken in steps "
        "of their own, on the thread that steps: `detect` is the network and waiting for it. In "
        "the laboratory on LiteRT unless something else stands there. The network alone, four "
        "crops on two threads: "
    )
    alone = [
        f"{metrics[f'network_ms.{runtime}'].value:.1f} ms ({runtime})"
        for runtime in _keys(metrics, "network_ms.")
    ]
    return _table(header, lines) + "\n\n" + said + ", ".join(alone) + "."


def _loops(metrics: _Metrics) -> str:
    lines = []
    for name in _keys(metrics, "lost_steps."):
        if name.startswith("fault."):
            continue
        lines.append(
            [
                name.replace("pose.", "pose: "),
                _cell(metrics[f"error_m.{name}.median"], 1000, 1, True),
                _cell(metrics[f"error_m.{name}.p95"], 1000, 0, True),
                _cell(metrics[f"coverage95.{name}"], 1, 2),
                _cell(metrics[f"std_over_error.{name}"], 1, 2),
                _cell(metrics[f"lost_steps.{name}"], 100, 1) + " %",
                str(metrics[f"error_m.{name}.median"].n),
            ]
        )
    header = ["", "median [mm]", "p95 [mm]", "coverage", "std/error", "steps lost", "joints"]
    return _table(header, lines)


def _views(metrics: _Metrics) -> str:
    lines = []
    for kind in ROWS:
        for row in _keys(metrics, f"detected.{kind}."):
            seen = metrics[f"detected.{kind}.{row}"]
            errors = [metrics.get(f"error_share.{kind}.{row}.{q}") for q in ("median", "p95")]
            cells = ["" if e is None else _cell(e, 100, 1, True) for e in errors]
            title = f"{kind}: {row.replace('_', ' ')}"
            lines.append([title, str(seen.n), _cell(seen, 100, 1, True), *cells])
    return _table(["", "crops", "detected [%]", "median error [%]", "p95 [%]"], lines)


def _emulator(metrics: _Metrics) -> str:
    lines = []
    for family in _keys(metrics, "emulator_coverage_difference."):
        ratio = metrics[f"emulator_error_ratio.{family}"]
        p95 = metrics[f"emulator_error_ratio.{family}.p95"]
        apart = metrics[f"emulator_coverage_difference.{family}"]
        coverage = f"{apart.value:+.3f} ({apart.low:+.3f} to {apart.high:+.3f})"
        lines.append(
            [family, _cell(ratio, 1, 2, True), _cell(p95, 1, 2, True), coverage, str(ratio.n)]
        )
    return _table(["", "median", "p95", "coverage less pixels'", "joints"], lines)


def _lost(metrics: _Metrics) -> str:
    said = []
    for start, level in (("", "pixels"), ("keypoints.", "keypoints")):
        each = [
            f"{name} {metrics[f'{start}error_ratio.lost.{name}'].value:.2f}"
            for name in _keys(metrics, f"{start}error_ratio.lost.")
        ]
        said.append(f"`{level}` " + ", ".join(each))
    return "; ".join(said)


def _keys(metrics: _Metrics, start: str) -> list[str]:
    """What comes after `start` in the names that begin so."""
    return [name.removeprefix(start) for name in metrics if name.startswith(start)]


def _cell(metric: Metric, scale: float, digits: int, interval: bool = False) -> str:
    text = f"{scale * metric.value:.{digits}f}"
    if interval:
        text += f" ({scale * metric.low:.{digits}f}-{scale * metric.high:.{digits}f})"
    return text


def _table(header: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    rows = [header, ["---", *["---:"] * (len(header) - 1)], *lines]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)
