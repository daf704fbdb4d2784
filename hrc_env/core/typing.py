"""Type aliases for arrays, which state the shape and the unit of an argument.

Axes, everywhere in this package: B batch (environments), W workers, C cameras, J joints (15, see
`hrc_env.core.skeleton`), S body segments of the worker (22), K capsules, P particles, T time, N
links of the arm.
"""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, NamedTuple, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Bools: TypeAlias = NDArray[np.bool_]
Ints: TypeAlias = NDArray[np.int64]
Records: TypeAlias = NDArray[Any]
"""A structured array. Its rows have named fields, which its dtype describes."""

Points2: TypeAlias = Annotated[Floats, "(..., 2) [px]"]
Points3: TypeAlias = Annotated[Floats, "(..., 3) [m]"]
Velocities3: TypeAlias = Annotated[Floats, "(..., 3) [m/s]"]
Covariances3: TypeAlias = Annotated[Floats, "(..., 3, 3) [m^2]"]
Rotations: TypeAlias = Annotated[Floats, "(..., 3, 3)"]
QuaternionsWxyz: TypeAlias = Annotated[Floats, "(..., 4), scalar first, unit norm"]
Transforms: TypeAlias = Annotated[Floats, "(..., 4, 4), parent_from_child"]
Capsules: TypeAlias = Annotated[Floats, "(..., K, 2, 3) end points [m]"]
JointAngles: TypeAlias = Annotated[Floats, "(..., N) [rad]"]
JointVelocities: TypeAlias = Annotated[Floats, "(..., N) [rad/s]"]
Image: TypeAlias = Annotated[NDArray[np.uint8], "(H, W, 3) RGB"]
Tensor: TypeAlias = NDArray[np.float32]
Rngs: TypeAlias = list[np.random.Generator]
"""Random generators, one for each environment of a batch."""


class Vector3(NamedTuple):
    """Three coordinates; the function that returns them states their frame and unit."""

    x: float
    """First coordinate."""
    y: float
    """Second coordinate."""
    z: float
    """Third coordinate."""


def is_array(value: object) -> TypeGuard[NDArray[Any]]:
    """Return whether a value is an array of any dtype."""
    return isinstance(value, np.ndarray)


def is_dict(value: object) -> TypeGuard[dict[Any, Any]]:
    """Return whether a value is a dictionary, with keys and values of any type."""
    return isinstance(value, dict)


def is_mapping(value: object) -> TypeGuard[Mapping[Any, Any]]:
    """Return whether a value is a mapping, with keys and values of any type."""
    return isinstance(value, Mapping)


def is_list_or_tuple(value: object) -> TypeGuard[list[Any] | tuple[Any, ...]]:
    """Return whether a value is a list or a tuple, with elements of any type."""
    return isinstance(value, list | tuple)


def is_numpy_scalar(value: object) -> TypeGuard["np.generic[Any]"]:
    """Return whether a value is a NumPy scalar of any type."""
    return isinstance(value, np.generic)


def is_sequence_of_text(value: object) -> TypeGuard[Sequence[str]]:
    """Return whether a value is a sequence of strings."""
    if not is_list_or_tuple(value):
        return isinstance(value, str)
    return all(isinstance(each, str) for each in value)
