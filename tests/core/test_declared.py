"""Declared records: the dtype follows the annotations, kernels and Python see the same rows."""

from typing import Annotated

import numpy as np
import pytest
from numpy.typing import NDArray

from hrc_env.core.declared import Records2, dtype_of, make_records
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Points3


class Lens:
    """A record inside another."""

    focal_px: float
    """Focal length [px]."""


class Track:
    """A record with every kind of field."""

    mean: Annotated[Points3, (4, 3)]
    """Position of each joint [m]."""
    votes: Annotated[NDArray[np.int8], (2,)]
    """Votes."""
    n: int
    """Number of updates."""
    age_s: float
    """Age [s]."""
    is_tracked: bool
    """Whether there is a track."""
    lens: Lens
    """The lens."""
    lenses: Annotated[Lens, (2,)]
    """Both lenses."""


TRACK = dtype_of(Track)


@kernel
def grow_old(tracks: Records2[Track], dt_s: float) -> None:
    """Age every track, and write into nested fields."""
    for e in range(len(tracks)):
        for w in range(tracks.shape[1]):
            track = tracks[e, w]
            track.age_s += dt_s
            track.mean[1, 2] = 3.0
            track.lens.focal_px = 500.0
            track.is_tracked = True


def test_dtype_has_the_fields_in_order_and_aligned() -> None:
    lens = np.dtype([("focal_px", "f8")], align=True)
    expected = [
        ("mean", "f8", (4, 3)), ("votes", "i1", (2,)), ("n", "i8"), ("age_s", "f8"),
        ("is_tracked", "?"), ("lens", lens), ("lenses", lens, (2,)),
    ]  # fmt: skip
    assert np.dtype(expected, align=True) == TRACK
    assert TRACK.isalignedstruct
    assert dtype_of(Track) is TRACK


def test_kernels_write_into_the_rows_that_python_reads() -> None:
    tracks = make_records(Track, (2, 3))
    grow_old(tracks, 0.5)
    assert tracks.shape == (2, 3)
    assert (tracks["age_s"] == 0.5).all()
    assert tracks["is_tracked"].all()
    assert (tracks["mean"][..., 1, 2] == 3.0).all()
    assert tracks["mean"].sum() == 18.0
    assert (tracks["lens"]["focal_px"] == 500.0).all()


class Unsized:
    """A record with an array of no declared shape."""

    mean: Floats
    """No shape."""


class Named:
    """A record with a text."""

    name: str
    """No number."""


@pytest.mark.parametrize(("declaration", "field"), [(Unsized, "mean"), (Named, "name")])
def test_a_field_that_is_no_number_is_refused(declaration: type, field: str) -> None:
    with pytest.raises(TypeError, match=f"The field {field} of a declared record must be bool"):
        dtype_of(declaration)
