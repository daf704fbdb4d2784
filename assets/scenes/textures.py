"""Surfaces painted by arithmetic: concrete, blockwork, boards, wood, cardboard.

Every function draws from a generator of its own fixed seed, so that the room looks the same
on every machine. Images are (H, W, 3) uint8; row 0 is the top of a wall.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.typing import Floats

Colour = Sequence[float]
Paint = NDArray[np.float64]
"""(H, W, 3) in 0..255, not yet rounded."""


def noise(rng: np.random.Generator, shape: tuple[int, int], cell_px: Sequence[float]) -> Floats:
    """Smooth noise (H, W) of standard normal values on a grid of cells (rows, columns) [px]."""
    height, width = shape
    rows, row_share = _grid(height, cell_px[0])
    columns, column_share = _grid(width, cell_px[1])
    grid = rng.standard_normal((rows.max() + 2, columns.max() + 2))
    coarse = grid[rows] * (1 - row_share[:, None]) + grid[rows + 1] * row_share[:, None]
    return coarse[:, columns] * (1 - column_share) + coarse[:, columns + 1] * column_share


def _grid(size: int, cell: float) -> tuple[NDArray[np.int64], Floats]:
    at = np.arange(size) / cell
    share = at - np.floor(at)
    return at.astype(int), share * share * (3 - 2 * share)


def mottled(
    rng: np.random.Generator, shape: tuple[int, int], colour: Colour, strength: float
) -> Paint:
    """A plain colour with cloudy and grainy changes of brightness of about `strength` levels."""
    clouds = sum(
        weight * noise(rng, shape, (cell, cell))
        for cell, weight in ((160.0, 0.9), (45.0, 0.6), (11.0, 0.4))
    )
    grain = 0.5 * rng.standard_normal(shape)
    return np.asarray(colour, float) + strength * (clouds + grain)[..., None]


def soften_edges(paint: Paint, reach_px: float, share: float) -> None:
    """Darken towards the image's border, as corners of rooms are (in place)."""
    height, width = paint.shape[:2]
    rows = np.minimum(np.arange(height), np.arange(height)[::-1])[:, None]
    columns = np.minimum(np.arange(width), np.arange(width)[::-1])[None]
    for distance in (rows, columns):
        paint *= (1 - share * np.exp(-distance / reach_px))[..., None]


def concrete_floor(size_m: Sequence[float], px_per_m: float) -> Paint:
    """Trowelled concrete with saw-cut joints, stains and scuffs."""
    rng = np.random.default_rng(11)
    shape = (round(size_m[1] * px_per_m), round(size_m[0] * px_per_m))
    paint = mottled(rng, shape, (158, 156, 151), 4.0)
    paint += 5.0 * noise(rng, shape, (330, 330))[..., None]
    for _ in range(16):  # old spills
        y, x = rng.uniform(0, shape[0]), rng.uniform(0, shape[1])
        radius = rng.uniform(0.06, 0.25) * px_per_m
        _blot(rng, paint, (y, x), radius, float(rng.uniform(-20, -6)))
    for _ in range(60):  # scuffs of boots and boards
        y, x, angle = rng.uniform(0, shape[0]), rng.uniform(0, shape[1]), rng.uniform(0, np.pi)
        _scratch(paint, (y, x), angle, rng.uniform(0.1, 0.5) * px_per_m, rng.uniform(-16, 12))
    for share in (1 / 3, 2 / 3):
        row, column = round(share * shape[0]), round(share * shape[1])
        paint[row - 1 : row + 2] *= 0.62
        paint[:, column - 1 : column + 2] *= 0.62
    soften_edges(paint, 0.14 * px_per_m, 0.34)
    return paint


def _blot(
    rng: np.random.Generator,
    paint: Paint,
    centre: tuple[float, float],
    radius: float,
    levels: float,
) -> None:
    rows, columns = _window(paint, centre, 2 * radius)
    y, x = np.mgrid[rows, columns]
    distance = np.hypot(y - centre[0], x - centre[1]) / radius
    ragged = distance + 0.25 * noise(rng, distance.shape, (radius / 3, radius / 3))
    paint[rows, columns] += levels * np.clip(1.4 - ragged, 0, 1)[..., None]


def _scratch(
    paint: Paint, start: tuple[float, float], angle: float, length: float, levels: float
) -> None:
    steps = np.arange(0, length, 0.7)
    y = (start[0] + steps * np.sin(angle)).astype(int)
    x = (start[1] + steps * np.cos(angle) + 3 * np.sin(steps / 30)).astype(int)
    inside = (y >= 0) & (y < paint.shape[0]) & (x >= 0) & (x < paint.shape[1])
    paint[y[inside], x[inside]] += levels


def _window(paint: Paint, centre: tuple[float, float], reach: float) -> tuple[slice, slice]:
    height, width = paint.shape[:2]
    return (
        slice(max(0, int(centre[0] - reach)), min(height, int(centre[0] + reach) + 1)),
        slice(max(0, int(centre[1] - reach)), min(width, int(centre[1] + reach) + 1)),
    )


def blockwork(size_m: Sequence[float], px_per_m: float, upper: Colour, lower: Colour) -> Paint:
    """A wall of painted concrete blocks, darker up to 1.1 m with a line between."""
    rng = np.random.default_rng(23)
    shape = (round(size_m[1] * px_per_m), round(size_m[0] * px_per_m))
    paint = mottled(rng, shape, (0, 0, 0), 3.0)
    split = round((size_m[1] - 1.1) * px_per_m)
    paint[:split] += np.asarray(upper, float)
    paint[split:] += np.asarray(lower, float)
    paint[split - 2 : split + 3] -= 40
    course, block = 0.2 * px_per_m, 0.4 * px_per_m
    for i in range(int(size_m[1] / 0.2) + 1):
        bottom = shape[0] - round(i * course)
        top = max(0, bottom - round(course))
        paint[max(0, bottom - 2) : bottom] -= 16
        for x in np.arange((i % 2) * block / 2, shape[1], block):
            paint[top:bottom, round(x) : round(x) + 2] -= 14
            paint[top:bottom, round(x) : round(x + block)] += rng.normal(0, 2.2)
    soften_edges(paint, 0.16 * px_per_m, 0.26)
    return paint


def plaster(size_m: Sequence[float], px_per_m: float, colour: Colour) -> Paint:
    """A plainly painted wall."""
    rng = np.random.default_rng(29)
    shape = (round(size_m[1] * px_per_m), round(size_m[0] * px_per_m))
    paint = mottled(rng, shape, colour, 1.8)
    soften_edges(paint, 0.2 * px_per_m, 0.24)
    return paint


def strand_board(size_m: Sequence[float], px_per_m: float) -> Paint:
    """Oriented strand board: the sheathing behind the studs."""
    rng = np.random.default_rng(31)
    shape = (round(size_m[1] * px_per_m), round(size_m[0] * px_per_m))
    paint = mottled(rng, shape, (193, 156, 104), 4.0)
    for _ in range(int(420 * size_m[0] * size_m[1])):
        y, x = int(rng.uniform(0, shape[0])), int(rng.uniform(0, shape[1]))
        length, width = rng.uniform(0.03, 0.09) * px_per_m, rng.uniform(0.008, 0.02) * px_per_m
        tilt, levels = rng.normal(0, 0.5), rng.normal(0, 15)
        for step in np.arange(0, width, 1.0):
            _scratch(paint, (y + step, x), tilt, length, levels)
    paint[:, :: round(1.2 * px_per_m)] *= 0.5
    soften_edges(paint, 0.16 * px_per_m, 0.3)
    return paint


def drywall(size_m: Sequence[float], px_per_m: float) -> Paint:
    """Plasterboard with filled joints and screw heads."""
    rng = np.random.default_rng(37)
    shape = (round(size_m[1] * px_per_m), round(size_m[0] * px_per_m))
    paint = mottled(rng, shape, (214, 211, 203), 1.6)
    seam = round(1.2 * px_per_m)
    for x in range(seam, shape[1], seam):
        band = 0.09 * px_per_m * (1 + 0.12 * noise(rng, (shape[0], 1), (30, 1))[:, 0])
        inside = np.abs(np.arange(shape[1])[None] - x) < band[:, None]
        paint[inside] = paint[inside] * 0.25 + 0.75 * 240
    for x in np.arange(0.2, size_m[0], 0.4):
        for y in np.arange(0.1, size_m[1], 0.3):
            row, column = round(y * px_per_m), round(x * px_per_m)
            paint[row - 4 : row + 5, column - 4 : column + 5] = 238
            paint[row - 1 : row + 1, column - 1 : column + 1] = 150
    soften_edges(paint, 0.05 * px_per_m, 0.12)
    return paint


def wood(colour: Colour, seed: int, shape: tuple[int, int] = (128, 512)) -> Paint:
    """Sawn wood, the grain along the rows."""
    rng = np.random.default_rng(seed)
    rings = noise(rng, shape, (22, 400)) * 6 + np.arange(shape[0])[:, None] / 5.0
    streaks = noise(rng, shape, (2.5, 160))
    paint = np.asarray(colour, float) + 7 * np.sin(rings)[..., None] + 6 * streaks[..., None]
    for _ in range(3):
        centre = (float(rng.uniform(10, shape[0] - 10)), float(rng.uniform(20, shape[1] - 20)))
        _blot(rng, paint, centre, float(rng.uniform(3, 6)), -55)
    return paint


def cardboard() -> Paint:
    """A carton's side with its tape and a label."""
    rng = np.random.default_rng(41)
    paint = mottled(rng, (256, 256), (186, 147, 102), 2.5)
    paint[:, 118:138] = paint[:, 118:138] * 0.35 + 0.65 * np.array([205, 176, 132])
    paint[150:214, 26:104] = 232
    paint[160:164, 34:92] = paint[172:176, 34:80] = paint[184:206:4, 34:92] = 70
    soften_edges(paint, 14, 0.25)
    return paint


def stacked_boards(count: int, colour: Colour, edge: Colour) -> Paint:
    """The side of a stack of boards: `count` layers with dark gaps."""
    rng = np.random.default_rng(43)
    paint = mottled(rng, (256, 256), colour, 3.0)
    step = 256 / count
    for i in range(count):
        row = round(i * step)
        paint[row : row + 3] = edge
        paint[row : round(row + step)] += rng.normal(0, 5)
    return paint


def sky(shape: tuple[int, int] = (128, 160)) -> Paint:
    """What is outside: a bright hazy sky with soft clouds over far roofs."""
    rng = np.random.default_rng(47)
    height = np.linspace(0, 1, shape[0])[:, None, None]
    paint = (1 - height) * np.array([128.0, 166, 206]) + height * np.array([196.0, 208, 216])
    paint = np.repeat(paint, shape[1], 1)
    clouds = np.clip(noise(rng, shape, (22, 48)) + 0.4 * noise(rng, shape, (7, 14)), 0, 1.2)
    paint += (225 - paint) * 0.55 * clouds[..., None]
    roofs = 0.84 - 0.03 * np.abs(((np.arange(shape[1]) / 34) % 2) - 1)
    paint[np.arange(shape[0])[:, None] / shape[0] > roofs] = (120, 122, 126)
    return paint


def sky_cube(side: int) -> Paint:
    """A bright hazy sky with soft clouds on the six faces of a cube, stacked (6 side, side, 3).

    In OpenGL's order of faces and axes, its +y being up: what MuJoCo takes as a sky.
    """
    rng = np.random.default_rng(53)
    s, t = np.meshgrid(*[(np.arange(side) + 0.5) / side * 2 - 1] * 2)
    one = np.ones_like(s)
    views = [(one, -t, -s), (-one, -t, s), (s, one, t), (s, -one, -t), (s, -t, one), (-s, -t, -one)]
    ways = np.stack([np.stack(view, -1) for view in views])
    ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
    up = np.clip(ways[..., 1], 0, 1)[..., None]
    paint = np.array([206.0, 216, 222]) * (1 - up**0.5) + np.array([92.0, 146, 206]) * up**0.5
    flat = ways[..., [0, 2]] / (0.25 + up)  # clouds lie on a level sheet
    clouds = np.zeros(ways.shape[:-1])
    for octave in range(6):
        for _ in range(3):
            wave = rng.standard_normal(2) * 1.9 * 1.8**octave
            clouds += 0.62**octave * np.sin(flat @ wave + rng.uniform(0, 2 * np.pi))
    share = np.clip(0.35 + 0.5 * clouds, 0, 1)[..., None] * np.clip(up * 5, 0, 1)
    paint += (np.array([246.0, 247, 248]) - paint) * 0.8 * share
    return paint.reshape(6 * side, side, 3)
