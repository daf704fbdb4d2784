"""Figure that compares pixels and emulator."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from assets.emulator.clips import DT_S, WARM_UP, find_family
from assets.emulator.validate import Compared, errors_in_image, lasting
from assets.emulator.watch import Watched
from hrc_env.core.typing import Floats
from hrc_env.perception.sightlines import HIDDEN, SEEN

PIXELS, EMULATOR = "#1b6ca8", "#e07b39"
LAGS = (1, 2, 4, 7, 12, 18, 25, 35)


def plot_comparison(path: Path, seen: Compared) -> None:
    """Plot sizes of errors in the image, their duration, and errors in space for both levels."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (sizes, times, space) = plt.subplots(1, 3, figsize=(13, 3.9), layout="constrained")
    emulated = [each for group in seen.emulated for each in group]
    for watched, colour, name in (
        (list(seen.pixels), PIXELS, "pixels"), (emulated, EMULATOR, "emulator"),
    ):  # fmt: skip
        for sight, style, word in ((SEEN, "-", "seen"), (HIDDEN, "--", "hidden")):
            values = np.sort(_lengths(watched, sight))
            share = np.linspace(0, 1, len(values))
            sizes.plot(100 * values, share, style, color=colour, label=f"{name}, {word}")
    sizes.set(
        xscale="log",
        xlim=(0.1, 40),
        xticks=(0.1, 1, 10),
        xticklabels=("0.1", "1", "10"),
        xlabel="2D error [% of the window's side]",
        ylabel="share of joints",
    )
    sizes.legend(fontsize=8, loc="upper left")
    for family, style in (("stand", "-"), ("walk", "--")):
        mine = [k for k, clip in enumerate(seen.clips) if find_family(clip.motion) == family]
        for level, colour, name in (
            ([seen.pixels[k] for k in mine], PIXELS, "pixels"),
            ([each for k in mine for each in seen.emulated[k]], EMULATOR, "emulator"),
        ):
            curve = [lasting(level, lag) for lag in LAGS]
            times.plot(np.array(LAGS) * DT_S, curve, style, color=colour, label=f"{name}, {family}")
    times.set(ylim=(0, 1), xlabel="time between [s]", ylabel="correlation of errors (2D)")
    times.legend(fontsize=8, loc="upper right")
    _bars(space, seen)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _bars(axis: Any, seen: Compared) -> None:
    names = list(seen.outcomes)
    at = np.arange(len(names))
    for shift, colour, level, name in (
        (-0.2, PIXELS, 0, "pixels"), (0.2, EMULATOR, 1, "emulator"),
    ):  # fmt: skip
        outcomes = [seen.outcomes[family][level] for family in names]
        axis.bar(at + shift, [1e3 * o.median_m for o in outcomes], 0.36, color=colour, label=name)
        axis.plot(at + shift, [1e3 * o.p95_m for o in outcomes], "_", color=colour, ms=14, mew=3)
    axis.set_xticks(at, names)
    marks = (10, 20, 50, 100, 200, 500)
    axis.set(yscale="log", ylim=(10, 600), ylabel="3D error after tracking [mm]")
    axis.set_yticks(marks, [str(each) for each in marks])
    axis.minorticks_off()
    axis.set_title("bars: median; dashes: 95th percentile", fontsize=9)
    axis.legend(fontsize=8)


def _lengths(watched: Sequence[Watched], sight: int) -> Floats:
    """Return lengths of the errors of joints of a kind of sight, as a share of the window's
    side."""
    parts = []
    for each in watched:
        length = errors_in_image(each)
        parts.append(length[(each.sight[WARM_UP:] == sight) & np.isfinite(length)])
    return np.concatenate(parts)
