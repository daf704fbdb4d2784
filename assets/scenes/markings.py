"""What is painted on floors round the robot: its cell in hazard stripes, its reach as a circle."""

import numpy as np

from assets.scenes import textures
from assets.scenes.textures import Paint
from hrc_env.core.typing import Bools, Floats

REACH_M = 1.35
YELLOW, BLACK, WHITE = (222, 176, 20), (34, 34, 34), (226, 226, 220)


def mark_cell(paint: Paint, dx: Floats, dy: Floats, px_per_m: float) -> Bools:
    """Paint the cell on a floor (H, W, 3), in place, worn by boots.

    Args:
        paint: the floor's picture.
        dx: (1, W) from the robot's axis [m].
        dy: (H, 1) the same.
        px_per_m: the picture's scale.

    Returns:
        (H, W) where paint has not been worn off.
    """
    worn = np.random.default_rng(5).random(paint.shape[:2]) < 0.9
    cell_px = 40 * px_per_m / 220
    worn &= textures.noise(np.random.default_rng(6), paint.shape[:2], (cell_px, cell_px)) > -1.7
    square = np.maximum(np.abs(dx), np.abs(dy))
    cell = (square > 0.52) & (square < 0.62)
    stripes = ((dx + dy) % 0.2) < 0.1
    blend(paint, cell & stripes & worn, YELLOW)
    blend(paint, cell & ~stripes & worn, BLACK)
    circle = np.abs(np.hypot(dx, dy) - REACH_M) < 0.025
    blend(paint, circle & worn & (np.arctan2(dy, dx) % 0.2 < 0.14), YELLOW)
    return worn


def blend(paint: Paint, where: Bools, colour: tuple[float, ...]) -> None:
    """Floor paint through which a fifth of the ground shows."""
    paint[where] = 0.22 * paint[where] + 0.78 * np.asarray(colour)
