"""What figures of all studies share: paper, error bars, axes, saving."""

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


def new_figure(width_in: float, height_in: float) -> Figure:
    """An empty figure that finds room for what is drawn."""
    return Figure(figsize=(width_in, height_in), layout="constrained")


def save(figure: Figure, path: Path, dpi: int = 110) -> None:
    """Write a PNG; its folder is made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=dpi)


def stamp(path: Path, words: str) -> None:
    """Write words across the top of a picture that is there, in a strip of its own."""
    with Image.open(path) as picture:
        drawn = picture.convert("RGB")
    size = max(12, drawn.width // 60)
    strip = Image.new("RGB", (drawn.width, drawn.height + 2 * size), "white")
    strip.paste(drawn, (0, 2 * size))
    place = (drawn.width // 2, size)
    font = ImageFont.load_default(size)
    ImageDraw.Draw(strip).text(place, words, "#b00020", font, anchor="mm")
    strip.save(path)


def ends(metrics: Sequence[Metric], scale: float = 1.0) -> Floats:
    """(2, n) how far the intervals go to either side of the values."""
    return scale * np.abs([[m.value - m.low, m.high - m.value] for m in metrics]).T


def label(axis: Axes, x: str = "", y: str = "", title: str = "", grid: str = "both") -> None:
    """Words at an axis, and a pale grid behind what is drawn."""
    axis.set_xlabel(x, fontsize=12)
    axis.set_ylabel(y, fontsize=12)
    axis.set_title(title, fontsize=13)
    axis.grid(True, axis=grid, color="0.9")  # type: ignore[arg-type]
    axis.set_axisbelow(True)


def plain_log(axis: Axis) -> None:
    """A logarithmic axis with plain numbers, as many as have room; call it when all is drawn."""
    low, high = axis.get_view_interval()
    span = np.log10(high / low)
    fine = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0) if span < 0.9 else (1.0, 2.0, 5.0)
    axis.set_major_locator(LogLocator(10, subs=fine if span < 2.5 else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))
    axis.set_minor_formatter(NullFormatter())
