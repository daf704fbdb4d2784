"""Less visible joints are less certain."""

import numpy as np
import pytest

from hrc_env.perception.noise import ERROR, VISIBILITY, error_share, sigma_px


def test_sigma_falls_with_visibility_and_grows_with_the_worker():
    confidence = np.linspace(0.01, 1, 50)
    assert np.all(np.diff(sigma_px(confidence, 400.0)) <= 0)
    np.testing.assert_allclose(sigma_px(confidence, 800.0), 2 * sigma_px(confidence, 400.0))


def test_no_measurement_is_infinitely_uncertain():
    assert np.isinf(sigma_px(np.zeros(3), 400.0)).all()


@pytest.mark.parametrize("confidence", [0.0, 0.05, 0.1, 0.2, 0.35, 0.7, 0.9, 0.975, 1.0])
def test_kernels_use_the_same_mapping(confidence):
    ours = error_share(confidence, VISIBILITY, ERROR)
    assert ours == pytest.approx(float(sigma_px(np.array(confidence), 1.0)))
