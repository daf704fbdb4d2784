"""Functions for the figures of all studies: style, error bars, axes and saving."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from PIL import Image, ImageDraw, ImageFont

from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats


def make_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure with a layout that adapts to its contents."""
    return Figure(figsize=(width_in, height_in), layout="constrained")


def save(figure: Figure, path: Path, dpi: int = 110) -> None:
    """Write a figure as a PNG file, and create its folder if necessary."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=dpi)


def stamp(path: Path, text: str) -> None:
    """Add a strip with a text at the top of a picture file."""
    with Image.open(path) as picture:
        image = picture.convert("RGB")
    size = max(12, image.width // 60)
    strip = Image.new("RGB", (image.width, image.height + 2 * size), "white")
    strip.paste(image, (0, 2 * size))
    place = (image.width // 2, size)
    font = ImageFont.load_default(size)
    ImageDraw.Draw(strip).text(place, text, "#b00020", font, anchor="mm")
    strip.save(path)


def compute_error_bars(metrics: Sequence[Metric], scale: float = 1.0) -> Floats:
    """Return the distances (2, n) from values to the lower and upper ends of their intervals.

    Metrics without an interval have NaN, for which no bar is drawn.
    """
    return scale * np.abs([[m.value - m.low, m.high - m.value] for m in metrics]).T


def label_axes(axis: Axes, x: str = "", y: str = "", title: str = "", grid: str = "both") -> None:
    """Set the labels and the title of axes, and draw a light grid in the background."""
    axis.set_xlabel(x, fontsize=12)
    axis.set_ylabel(y, fontsize=12)
    axis.set_title(title, fontsize=13)
    axis.grid(True, axis=grid, color="0.9")  # type: ignore[arg-type]
    axis.set_axisbelow(True)


def use_plain_log_ticks(axis: Axis) -> None:
    """Label a logarithmic axis with plain numbers; call it after drawing the data."""
    low, high = axis.get_view_interval()
    span = np.log10(high / low)
    fine = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0) if span < 0.9 else (1.0, 2.0, 5.0)
    axis.set_major_locator(LogLocator(10, subs=fine if span < 2.5 else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))
    axis.set_minor_formatter(NullFormatter())
