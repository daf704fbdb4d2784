"""Pictures of a worker, for this room's tests."""

import json

import cv2
import numpy as np
import pytest
from stored import DATA, PICTURES


@pytest.fixture(scope="session")
def pictures():
    """RGB pictures by name: one rendered worker in each."""
    return {
        name: cv2.cvtColor(cv2.imread(str(DATA / name)), cv2.COLOR_BGR2RGB) for name in PICTURES
    }


@pytest.fixture(scope="session")
def reference():
    """(33, 3) landmarks of the official package by picture (reference/make_reference.py)."""
    stored = json.loads((DATA / "reference.json").read_text())["landmarks_px"]
    return {name: np.array(rows) for name, rows in stored.items()}
