"""The report of the site experiment."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from hrc_env.core.results import Metric
from hrc_env.experiments.site.figures import COLUMNS, PAPER_RMSE_M, spoken
from hrc_env.experiments.site.metrics import best
from hrc_env.experiments.site.rows import MULTI, WARM_UP_S
from hrc_env.experiments.study.intervals import apart
from hrc_env.experiments.study.page import Part, Picture, Section, Table, said, write_report

if TYPE_CHECKING:
    from hrc_env.experiments.site.experiment import SiteConfig

Metrics = Mapping[str, Metric]
SINGLES = COLUMNS[:4]
TITLE = "One camera or four: the paper's simulation, again"
ABOUT_THE_TABLE = """\
RMSE of the head in metres; in brackets 95 % intervals, bootstrapped over walks. Everybody is given
the same film: detections made with the crops of the four-camera track. """
ABOUT_DEPTH = """\
They also get the crops of the four-camera track, which they could not have made. What remains is
the depth along the ray: the size of a body in the image fixes it only as well as the lengths of
its bones are known, and nothing fixes it while the body is hidden."""
ABOUT_MORE = """\
Two and three cameras: all choices of them together, on the shared film. With crops of their own,
estimators look where they themselves expect the worker; who loses them searches the whole image,
where people are small."""
ASSUMED = """\
What had to be assumed, because the paper does not say it: intrinsics of the cameras (72 degrees
wide, 1280 x 720), where they look (the middle of the site, 0.9 m high), what stands where, how the
worker walks and dresses, the time between images (40 ms), the noise of the filter, and what
"head" is (here: the nose). The robot's arm rests. The paper's unit is not printed; metres are
meant. It used another simulator and another renderer, so that its numbers and ours stand beside
each other and are not the same measurement."""


def report(out: Path, config: "SiteConfig", metrics: Metrics) -> None:
    """Write report.html and report.md into `out`; the figures are there."""
    everybody = tuple(name.split(".")[1] for name in metrics if name.startswith("over_multi."))
    everybody = tuple(dict.fromkeys(everybody))
    sections = [
        Section("What was done", _done(config, out / "figures")),
        Section("What came out", _came_out(config, metrics, everybody, out / "figures")),
        Section("Is it fair to the single camera?", _fair(metrics, everybody)),
        Section("Two and three cameras, and crops of one's own", _more(metrics, config)),
        Section("What it does not mean", (ASSUMED, f"Settings: {asdict(config)}.")),
    ]
    write_report(out, TITLE, _lead(config, metrics), sections)


def _lead(config: "SiteConfig", metrics: Metrics) -> str:
    name = config.estimators[0]
    four = said(metrics[f"rmse_m.{name}.{MULTI}"], 100)
    alone = [metrics[f"rmse_m.{name}.{camera}"].value for camera in SINGLES]
    return (
        "A worker walks over a construction site of 20 x 20 m, behind and past what stands there. "
        f"Four cameras and `{name}` know the head to {four} cm (RMSE); "
        f"one camera of them knows it to {min(alone):.2f} to {max(alone):.2f} m."
    )


def _done(config: "SiteConfig", figures: Path) -> tuple[Part, ...]:
    last = config.first_seed + config.n_seeds - 1
    words = (
        f"{config.n_seeds} walks of {config.seconds:.0f} s (seeds {config.first_seed} to {last}), "
        "rendered for four cameras in the corners at 5 m; MediaPipe Pose on crops, every image at "
        f"25 Hz. Everybody begins with {WARM_UP_S:.0f} s of all four cameras, as no estimator "
        "begins a track with one; then the others are taken away. Errors are of the nose, in every "
        "frame after that, also where the track is lost: the last word is the answer."
    )
    place = "The paper's figure 3, our site: (a) from above, (b) from each camera."
    return words, Picture(figures / "figure_3.png", place)


def _came_out(
    config: "SiteConfig", metrics: Metrics, everybody: tuple[str, ...], figures: Path
) -> tuple[Part, ...]:
    rows = [("the paper reports", *(f"{PAPER_RMSE_M[c]:.3f}" for c in COLUMNS))]
    for name in config.estimators:
        rows.append((f"`{name}`", *(said(metrics[f"rmse_m.{name}.{c}"], 1, 3) for c in COLUMNS)))
    paths = [
        Picture(
            figures / f"figure_4_{name}.png",
            f"The paper's figure 4: the first walk from above, `{name}`; grey: what stands there.",
        )
        for name in config.estimators
    ]
    return (
        Table(("RMSE [m]", *map(spoken, COLUMNS)), tuple(rows)),
        ABOUT_THE_TABLE + _conclusion(metrics, everybody),
        Picture(figures / "rmse.png", "RMSE on the shared film, log scale."),
        *paths,
    )


def _conclusion(metrics: Metrics, everybody: tuple[str, ...]) -> str:
    """Whether the paper's conclusion holds, estimator by estimator."""
    words = []
    for name in everybody:
        four = metrics[f"rmse_m.{name}.{MULTI}"]
        least = min(
            (metrics[f"over_multi.{name}.{camera}"] for camera in SINGLES),
            key=lambda ratio: ratio.value,
        )
        free = all(apart(metrics[f"rmse_m.{name}.{camera}"], four) for camera in SINGLES)
        words.append(
            f"`{name}`: the best single camera is {said(least)} times worse than four, intervals "
            f"{'apart' if free else 'touching'}"
        )
    return "; ".join(words) + "."


def _fair(metrics: Metrics, everybody: tuple[str, ...]) -> tuple[Part, ...]:
    names = ", ".join(f"`{best(metrics, camera, everybody)}`" for camera in SINGLES)
    words = f"Single cameras get the best of these estimators (cameras 1 to 4: {names}). "
    rows = [
        (f"`{name}`", *(said(metrics[f"over_multi.{name}.{camera}"]) for camera in SINGLES))
        for name in everybody
    ]
    header = ("one over four, walk by walk", *map(spoken, SINGLES))
    return words + ABOUT_DEPTH, Table(header, tuple(rows))


def _more(metrics: Metrics, config: "SiteConfig") -> tuple[Part, ...]:
    rows = []
    for name in config.estimators:
        shown = [metrics[f"rmse_m.{name}.{word}"] for word in ("two", "three")]
        shown += [metrics[f"closed_rmse_m.{name}.{column}"] for column in COLUMNS]
        rows.append((f"`{name}`", *(said(each, 1, 3) for each in shown)))
    own = tuple(f"own crops, {spoken(column)}" for column in COLUMNS)
    walks = f"Own crops: the first {min(config.n_closed, config.n_seeds)} of the walks, again. "
    return Table(("RMSE [m]", "two", "three", *own), tuple(rows)), walks + ABOUT_MORE
