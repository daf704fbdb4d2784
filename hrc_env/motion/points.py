"""Points and poses on the floor, and pairs of related numbers.

Kernels take and return these named tuples; points in space are `hrc_env.core.typing.Vector3`.
"""

from typing import NamedTuple


class Point(NamedTuple):
    """A point on the floor."""

    x: float
    """World x [m]."""
    y: float
    """World y [m]."""


class FloorPose(NamedTuple):
    """A point on the floor with a heading."""

    x: float
    """World x [m]."""
    y: float
    """World y [m]."""
    yaw: float
    """Heading about world z [rad]."""


class Place(NamedTuple):
    """A pose at which a worker stands, with the height of the work there."""

    x: float
    """World x [m]."""
    y: float
    """World y [m]."""
    yaw: float
    """Heading about world z [rad]."""
    height: float
    """Height of the work above the floor [m]."""


class SagittalShift(NamedTuple):
    """A displacement in the vertical plane that contains a heading."""

    ahead: float
    """Displacement along the heading [m]."""
    up: float
    """Vertical displacement [m]."""


class Sides(NamedTuple):
    """A value for the left and one for the right hand."""

    left: float
    """Value of the left hand."""
    right: float
    """Value of the right hand."""
