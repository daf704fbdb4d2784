"""What tests of several rooms need."""

import pytest

from hrc_env.perception.weights import fetch_weights


@pytest.fixture(scope="session")
def weights():
    """The official weights; downloaded at the first run, offline afterwards."""
    return fetch_weights()
