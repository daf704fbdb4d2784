"""Lenses: where light that a pinhole would show at one place arrives in the real image.

Places are normalised: pixels less the principal point, over the focal lengths; "undistorted" ones
are the pinhole's, "distorted" ones the image's. Two models, with OpenCV's coefficients:

| model | distorted from undistorted |
|---|---|
| `brown_conrady` | radius times 1 + k1 r^2 + k2 r^4 + k3 r^6, and decentring p1, p2 (Brown 1966) |
| `kannala_brandt` | angle t from the axis at radius t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8) |

(Kannala and Brandt 2006, in OpenCV's `fisheye`.) A polynomial folds the image over where it no
longer grows; what lies beyond is not seen.
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.kernels import kernel
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.typing import Floats

COEFFICIENTS = {
    "none": (),
    "brown_conrady": ("k1", "k2", "p1", "p2", "k3"),
    "kannala_brandt": ("k1", "k2", "k3", "k4"),
}
"""Models and what their coefficients are called, in order; those left out are 0."""
NONE, BROWN_CONRADY, KANNALA_BRANDT = range(3)
LIMIT, FOLD = 6, 7
"""Columns of a lens' row: the distorted radius from which on nothing is seen, and its angle."""
WIDEST_RAD = math.radians(175.0)
"""No lens sees further from its axis."""
PINHOLE_RAD = math.radians(80.0)
"""Further from the axis [rad] a pinhole's image has no place for what a lens sees."""
FAR = 1e6
_SAMPLES = 4096
_NEWTON_STEPS = 12
_STEP = 1e-5


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class Lens:
    """How a lens bends the image."""

    model: str = "none"
    """"none", "brown_conrady" or "kannala_brandt"."""
    coefficients: tuple[float, ...] = ()
    """The model's, in OpenCV's order: k1, k2, p1, p2, k3, or k1, k2, k3, k4; the rest is 0."""

    def __post_init__(self) -> None:
        check_names("lens model", [self.model], COEFFICIENTS)
        names = COEFFICIENTS[self.model]
        if len(self.coefficients) > len(names) or not np.isfinite(self.coefficients).all():
            raise ConfigError(
                f"A lens of model {self.model!r} has up to {len(names)} finite coefficients"
                f"{' (' + ', '.join(names) + ')' if names else ''}, got {self.coefficients}."
            )


@functools.lru_cache(maxsize=64)
def lens_row(lens: Lens) -> Floats:
    """(8,) a lens as numbers for the kernels: model, coefficients, `LIMIT`, `FOLD`."""
    row = np.zeros(FOLD + 1)
    row[0] = list(COEFFICIENTS).index(lens.model)
    row[1 : 1 + len(lens.coefficients)] = lens.coefficients
    widest = WIDEST_RAD if lens.model == "kannala_brandt" else PINHOLE_RAD
    angle = np.linspace(0.0, widest, _SAMPLES)
    radius = np.array([_radius_of(row, each) for each in angle])
    falls = np.flatnonzero(np.diff(radius) <= 0)
    last = falls[0] if len(falls) else -1
    row[LIMIT], row[FOLD] = radius[last], angle[last]
    row.setflags(write=False)
    return row


def distort(lens: Lens, undistorted: Floats) -> Floats:
    """Undistorted places (..., 2) to distorted ones."""
    return _each(distorted, lens, undistorted).reshape(np.shape(undistorted))


def magnification(lens: Lens, undistorted: Floats) -> Floats:
    """(...,) how many times longer a pinhole shows a short line at undistorted places (..., 2) than
    the lens does; the mean of both directions."""
    return _each(magnification_at, lens, undistorted).reshape(np.shape(undistorted)[:-1])


def undistort(lens: Lens, distorted: Floats) -> Floats:
    """Distorted places (..., 2) to undistorted ones; NaN beyond `PINHOLE_RAD` from the axis."""
    ray = rays_cam(lens, distorted)
    ahead = ray[..., 2:] > math.cos(PINHOLE_RAD)
    return np.where(ahead, ray[..., :2] / np.where(ahead, ray[..., 2:], 1.0), np.nan)


def rays_cam(lens: Lens, distorted: Floats) -> Floats:
    """(..., 3) unit directions, camera axes, of distorted places (..., 2); NaN where none is."""
    flat = np.ascontiguousarray(distorted, float).reshape(-1, 2)
    out = np.empty((len(flat), 3))
    _rays_all(lens_row(lens), flat, out)
    return out.reshape(*np.shape(distorted)[:-1], 3)


def distorted_radius(lens: Lens, angle_rad: float) -> float:
    """Where light at an angle to the axis arrives [focal lengths]; NaN beyond the lens."""
    row = lens_row(lens)
    return float(_radius_of(row, angle_rad)) if angle_rad <= row[FOLD] else math.nan


def _each(at: Callable[..., Any], lens: Lens, places: Floats) -> Floats:
    row, flat = lens_row(lens), np.asarray(places, float).reshape(-1, 2)
    return np.array([at(row, x, y) for x, y in flat.tolist()], float)


@kernel
def _rays_all(row, places, out):
    for i in range(len(places)):
        out[i, 0], out[i, 1], out[i, 2] = _ray(row, places[i, 0], places[i, 1])


@kernel
def distorted(row, x, y):
    """Where the lens of a row shows what a pinhole shows at x, y; far away what it does not see."""
    squared = x * x + y * y
    if row[0] != NONE and squared > math.tan(row[FOLD]) ** 2 and row[FOLD] < 0.5 * math.pi:
        return FAR * x, FAR * y
    if row[0] == BROWN_CONRADY:
        radial = 1.0 + squared * (row[1] + squared * (row[2] + squared * row[5]))
        aside_x = 2.0 * row[3] * x * y + row[4] * (squared + 2.0 * x * x)
        aside_y = row[3] * (squared + 2.0 * y * y) + 2.0 * row[4] * x * y
        return x * radial + aside_x, y * radial + aside_y
    if row[0] == KANNALA_BRANDT:
        radius = math.sqrt(squared)
        if radius < 1e-12:
            return x, y
        scale = _radius_of(row, math.atan(radius)) / radius
        return x * scale, y * scale
    return x, y


@kernel
def magnification_at(row, x, y):
    """`magnification` at one undistorted place."""
    if row[0] == NONE:
        return 1.0
    left, right = distorted(row, x - _STEP, y), distorted(row, x + _STEP, y)
    above, below = distorted(row, x, y - _STEP), distorted(row, x, y + _STEP)
    area = (right[0] - left[0]) * (below[1] - above[1])
    area -= (right[1] - left[1]) * (below[0] - above[0])
    return 2.0 * _STEP / math.sqrt(max(abs(area), 1e-18))


@kernel
def _radius_of(row, angle):
    """How far from the middle light arrives that comes at an angle [rad] to the axis."""
    if row[0] == KANNALA_BRANDT:
        s = angle * angle
        return angle * (1.0 + s * (row[1] + s * (row[2] + s * (row[3] + s * row[4]))))
    radius = math.tan(angle)
    if row[0] == BROWN_CONRADY:
        s = radius * radius
        return radius * (1.0 + s * (row[1] + s * (row[2] + s * row[5])))
    return radius


@kernel
def _ray(row, x, y):
    """Unit direction of a distorted place; NaN where nothing is seen."""
    far = math.sqrt(x * x + y * y)
    if not far < row[LIMIT]:
        return np.nan, np.nan, np.nan
    if row[0] == KANNALA_BRANDT:
        if far < 1e-12:
            return 0.0, 0.0, 1.0
        angle = _angle_of(row, far)
        aside = math.sin(angle) / far
        return aside * x, aside * y, math.cos(angle)
    u, v = x, y
    if row[0] == BROWN_CONRADY:
        along = math.tan(_angle_of(row, far)) / max(far, 1e-12)
        u, v = _without_decentring(row, x, y, along * x, along * y)
    length = math.sqrt(u * u + v * v + 1.0)
    return u / length, v / length, 1.0 / length


@kernel
def _angle_of(row, far):
    """The angle [rad] whose light arrives at a radius below the limit: Newton or bisection."""
    low, high = 0.0, row[FOLD]
    angle = min(far, 0.5 * high)
    for _ in range(60):
        off = _radius_of(row, angle) - far
        if off > 0.0:
            high = angle
        else:
            low = angle
        slope = (_radius_of(row, angle + _STEP) - off - far) / _STEP
        step = off / slope if slope > 0.0 else np.inf
        if abs(step) < 1e-13:
            break
        angle = angle - step if low < angle - step < high else 0.5 * (low + high)
    return angle


@kernel
def _without_decentring(row, x, y, u, v):
    """Newton's steps from a first guess to the undistorted place that is distorted to x, y."""
    for _ in range(_NEWTON_STEPS):
        at = distorted(row, u, v)
        off_x, off_y = at[0] - x, at[1] - y
        if off_x * off_x + off_y * off_y < 1e-24:
            break
        right, below = distorted(row, u + _STEP, v), distorted(row, u, v + _STEP)
        a, b = (right[0] - at[0]) / _STEP, (below[0] - at[0]) / _STEP
        c, d = (right[1] - at[1]) / _STEP, (below[1] - at[1]) / _STEP
        det = a * d - b * c
        u -= (d * off_x - b * off_y) / det
        v -= (a * off_y - c * off_x) / det
    return u, v
