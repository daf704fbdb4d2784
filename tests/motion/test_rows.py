"""Rows of the workers' record in Python: fields are attributes, and arrays can be copied."""

import copy
import pickle

import numpy as np
import pytest

from hrc_env.motion.lying import LOAD
from hrc_env.motion.state import WORKER


@pytest.mark.parametrize("dtype", [WORKER, LOAD])
def test_fields_of_a_row_are_attributes(dtype):
    rows = np.zeros(2, dtype)
    for name in dtype.names:
        setattr(rows[1], name, 1)
        assert np.all(getattr(rows[1], name) == 1)
        assert not np.any(rows[name][0])


def test_a_field_of_an_array_is_written_in_place():
    rows = np.zeros(2, WORKER)
    rows[1].place[:] = 1.0, 2.0, 3.0, 4.0
    assert rows["place"][1].tolist() == [1.0, 2.0, 3.0, 4.0]


def test_an_unknown_field_is_an_error():
    with pytest.raises(AttributeError):
        _ = np.zeros(1, WORKER)[0].palce


def test_rows_are_copied_and_pickled():
    rows = np.zeros(2, WORKER)
    worker = copy.copy(rows[0])
    rows[0].job = 7
    assert (worker.job, rows[0].job) == (0, 7)
    again = pickle.loads(pickle.dumps(rows))
    assert again.dtype == WORKER
    assert again[0].job == 7
