"""Distortion of images by lenses, relative to a pinhole camera.

Points are in normalised image coordinates: pixels minus the principal point, divided by the focal
lengths. "Undistorted" points are those of the pinhole camera, "distorted" points those in the real
image. There are two models, with OpenCV's coefficients:

| model | distorted from undistorted |
|---|---|
| `brown_conrady` | radius times 1 + k1 r^2 + k2 r^4 + k3 r^6, and decentring p1, p2 (Brown 1966) |
| `kannala_brandt` | angle t from the axis at radius t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8) |

The second is that of Kannala and Brandt (2006) and of OpenCV's `fisheye` module. Beyond the angle
at which the polynomial reaches its maximum, the model would fold the image over; light from such
angles is not imaged.

Kernels take a lens as a row (8,): model, five coefficients, `LIMIT` and `FOLD` (see `lens_row`).
"""

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.batching import flatten_axes
from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.kernels import kernel
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.typing import Floats, Points3, Vector3

COEFFICIENTS: dict[str, tuple[str, ...]] = {
    "none": (),
    "brown_conrady": ("k1", "k2", "p1", "p2", "k3"),
    "kannala_brandt": ("k1", "k2", "k3", "k4"),
}
"""Names of the coefficients of each model, in OpenCV's order."""
NONE, BROWN_CONRADY, KANNALA_BRANDT = range(3)
"""Numbers that identify the models in the row of a lens."""
LIMIT, FOLD = 6, 7
"""Columns of a lens's row with the distorted radius beyond which nothing is imaged [focal lengths]
and the corresponding angle from the optical axis [rad]."""
WIDEST_RAD = math.radians(175.0)
"""Maximum angle from the optical axis that a fisheye lens can image [rad]."""
PINHOLE_RAD = math.radians(80.0)
"""Maximum angle from the optical axis at which undistorted points are defined [rad]."""
FAR = 1e6
"""Factor by which points that a lens does not image are moved away from the image centre."""
_SAMPLES = 4096
_NEWTON_STEPS = 12
_STEP = 1e-5


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class Lens:
    """A distortion model of a lens with its coefficients."""

    model: str = "none"
    """Name of the model: "none", "brown_conrady" or "kannala_brandt"."""
    coefficients: tuple[float, ...] = ()
    """Coefficients of the model in OpenCV's order: k1, k2, p1, p2, k3 for "brown_conrady", and k1,
    k2, k3, k4 for "kannala_brandt"; omitted coefficients are 0."""

    def __post_init__(self) -> None:
        check_names("lens model", [self.model], COEFFICIENTS)
        names = COEFFICIENTS[self.model]
        if len(self.coefficients) > len(names) or not np.isfinite(self.coefficients).all():
            raise ConfigError(
                f"A lens of model {self.model!r} has up to {len(names)} finite coefficients"
                f"{' (' + ', '.join(names) + ')' if names else ''}, got {self.coefficients}."
            )


class ImagePoint(NamedTuple):
    """A point in the image plane, relative to the principal point."""

    x: float
    """Coordinate to the right [focal lengths]."""
    y: float
    """Coordinate downwards [focal lengths]."""


@functools.lru_cache(maxsize=64)
def lens_row(lens: Lens) -> Floats:
    """Return the row (8,) of a lens for kernels: model, coefficients, `LIMIT` and `FOLD`."""
    row = np.zeros(FOLD + 1)
    row[0] = list(COEFFICIENTS).index(lens.model)
    row[1 : 1 + len(lens.coefficients)] = lens.coefficients
    widest = WIDEST_RAD if lens.model == "kannala_brandt" else PINHOLE_RAD
    angle = np.linspace(0.0, widest, _SAMPLES)
    radius = np.array([_radius_at(row, each) for each in angle])
    falls = np.flatnonzero(np.diff(radius) <= 0)
    last = falls[0] if len(falls) else -1
    row[LIMIT], row[FOLD] = radius[last], angle[last]
    row.setflags(write=False)
    return row


def distort(lens: Lens, undistorted: Floats) -> Floats:
    """Convert undistorted points (..., 2) to distorted ones."""
    places = flatten_axes(np.asarray(undistorted, float), 1)
    out = np.empty(places.shape)
    _distort_all(lens_row(lens), places, out)
    return out.reshape(np.shape(undistorted))


def magnification(lens: Lens, undistorted: Floats) -> Floats:
    """Return the local ratio of lengths in the pinhole image to lengths in the real image.

    Args:
        lens: the lens.
        undistorted: (..., 2) position in the pinhole image.

    Returns:
        (...,) geometric mean of the ratios in two orthogonal directions.
    """
    places = flatten_axes(np.asarray(undistorted, float), 1)
    out = np.empty(len(places))
    _magnify_all(lens_row(lens), places, out)
    return out.reshape(np.shape(undistorted)[:-1])


def undistort(lens: Lens, distorted: Floats) -> Floats:
    """Convert distorted points (..., 2) to undistorted ones, or NaN beyond `PINHOLE_RAD`."""
    ray = rays_cam(lens, distorted)
    ahead = ray[..., 2:] > math.cos(PINHOLE_RAD)
    return np.where(ahead, ray[..., :2] / np.where(ahead, ray[..., 2:], 1.0), np.nan)


def rays_cam(lens: Lens, distorted: Floats) -> Points3:
    """Return unit vectors (..., 3), in camera axes, to distorted points (..., 2).

    They are NaN for points that the lens does not image.
    """
    places = flatten_axes(np.asarray(distorted, float), 1)
    out = np.empty((len(places), 3))
    _cast_rays(lens_row(lens), places, out)
    return out.reshape(*np.shape(distorted)[:-1], 3)


def distorted_radius(lens: Lens, angle_rad: float) -> float:
    """Return the distorted radius of light at an angle to the axis [focal lengths].

    It is NaN for light that the lens does not image.
    """
    row = lens_row(lens)
    return float(_radius_at(row, angle_rad)) if angle_rad <= row[FOLD] else math.nan


@kernel
def _distort_all(row: Floats, places: Floats, out: Floats) -> None:
    """Convert undistorted points (n, 2) to distorted points `out` (n, 2)."""
    for i in range(len(places)):
        out[i, 0], out[i, 1] = distort_point(row, places[i, 0], places[i, 1])


@kernel
def _magnify_all(row: Floats, places: Floats, out: Floats) -> None:
    """Compute the magnification `out` (n,) at undistorted points (n, 2)."""
    for i in range(len(places)):
        out[i] = magnification_at(row, places[i, 0], places[i, 1])


@kernel
def _cast_rays(row: Floats, places: Floats, out: Points3) -> None:
    """Compute unit directions `out` (n, 3) in camera axes of distorted points (n, 2)."""
    for i in range(len(places)):
        out[i, 0], out[i, 1], out[i, 2] = _unit_ray(row, places[i, 0], places[i, 1])


@kernel
def distort_point(row: Floats, x: float, y: float) -> ImagePoint:
    """Return the distorted position of an undistorted point; a distant one if it is not imaged."""
    squared = x * x + y * y
    if row[0] != NONE and squared > math.tan(row[FOLD]) ** 2 and row[FOLD] < 0.5 * math.pi:
        return ImagePoint(FAR * x, FAR * y)
    if row[0] == BROWN_CONRADY:
        radial = 1.0 + squared * (row[1] + squared * (row[2] + squared * row[5]))
        aside_x = 2.0 * row[3] * x * y + row[4] * (squared + 2.0 * x * x)
        aside_y = row[3] * (squared + 2.0 * y * y) + 2.0 * row[4] * x * y
        return ImagePoint(x * radial + aside_x, y * radial + aside_y)
    if row[0] == KANNALA_BRANDT:
        radius = math.sqrt(squared)
        if radius < 1e-12:
            return ImagePoint(x, y)
        scale = _radius_at(row, math.atan(radius)) / radius
        return ImagePoint(x * scale, y * scale)
    return ImagePoint(x, y)


@kernel
def magnification_at(row: Floats, x: float, y: float) -> float:
    """Return the `magnification` of a lens at a single undistorted point."""
    if row[0] == NONE:
        return 1.0
    left, right = distort_point(row, x - _STEP, y), distort_point(row, x + _STEP, y)
    above, below = distort_point(row, x, y - _STEP), distort_point(row, x, y + _STEP)
    area = (right.x - left.x) * (below.y - above.y)
    area -= (right.y - left.y) * (below.x - above.x)
    return 2.0 * _STEP / math.sqrt(max(abs(area), 1e-18))


@kernel
def _radius_at(row: Floats, angle: float) -> float:
    """Return the distorted radius of light at an angle [rad] to the axis [focal lengths]."""
    if row[0] == KANNALA_BRANDT:
        s = angle * angle
        return angle * (1.0 + s * (row[1] + s * (row[2] + s * (row[3] + s * row[4]))))
    radius = math.tan(angle)
    if row[0] == BROWN_CONRADY:
        s = radius * radius
        return radius * (1.0 + s * (row[1] + s * (row[2] + s * row[5])))
    return radius


@kernel
def _unit_ray(row: Floats, x: float, y: float) -> Vector3:
    """Return the unit direction of a distorted point in camera axes, or NaN if it has none."""
    radius = math.sqrt(x * x + y * y)
    if not radius < row[LIMIT]:
        return Vector3(np.nan, np.nan, np.nan)
    if row[0] == KANNALA_BRANDT:
        if radius < 1e-12:
            return Vector3(0.0, 0.0, 1.0)
        angle = _solve_angle(row, radius)
        aside = math.sin(angle) / radius
        return Vector3(aside * x, aside * y, math.cos(angle))
    u, v = x, y
    if row[0] == BROWN_CONRADY:
        along = math.tan(_solve_angle(row, radius)) / max(radius, 1e-12)
        u, v = _remove_decentring(row, x, y, along * x, along * y)
    length = math.sqrt(u * u + v * v + 1.0)
    return Vector3(u / length, v / length, 1.0 / length)


@kernel
def _solve_angle(row: Floats, radius: float) -> float:
    """Return the angle to the axis [rad] of light that arrives at a radius below the limit.

    The equation is solved by Newton's method, with a bisection step whenever a Newton step leaves
    the bracket.
    """
    low, high = 0.0, row[FOLD]
    angle = min(radius, 0.5 * high)
    for _ in range(60):
        off = _radius_at(row, angle) - radius
        if off > 0.0:
            high = angle
        else:
            low = angle
        slope = (_radius_at(row, angle + _STEP) - off - radius) / _STEP
        step = off / slope if slope > 0.0 else np.inf
        if abs(step) < 1e-13:
            break
        angle = angle - step if low < angle - step < high else 0.5 * (low + high)
    return angle


@kernel
def _remove_decentring(row: Floats, x: float, y: float, u: float, v: float) -> ImagePoint:
    """Return the undistorted position of a distorted point, by Newton's method.

    Args:
        row: (8,) row of the lens.
        x: first coordinate of the distorted point.
        y: second coordinate of the distorted point.
        u: initial guess of the undistorted point's first coordinate.
        v: initial guess of the undistorted point's second coordinate.
    """
    for _ in range(_NEWTON_STEPS):
        at = distort_point(row, u, v)
        off_x, off_y = at.x - x, at.y - y
        if off_x * off_x + off_y * off_y < 1e-24:
            break
        right, below = distort_point(row, u + _STEP, v), distort_point(row, u, v + _STEP)
        a, b = (right.x - at.x) / _STEP, (below.x - at.x) / _STEP
        c, d = (right.y - at.y) / _STEP, (below.y - at.y) / _STEP
        det = a * d - b * c
        u -= (d * off_x - b * off_y) / det
        v -= (a * off_y - c * off_x) / det
    return ImagePoint(u, v)
