"""The one mapping from joint and visibility to standard deviation."""

import numpy as np
import pytest

from hrc_env.core.skeleton import JOINT, N_JOINTS
from hrc_env.perception.noise import ERROR, VISIBILITY, error_share, sigma_px


def test_more_visible_joints_are_surer_and_larger_people_cost_more_pixels():
    confidence = np.repeat(np.linspace(0.01, 1.0, 50)[:, None], N_JOINTS, axis=1)
    assert np.all(np.diff(sigma_px(confidence, 400.0), axis=0) <= 1e-12)
    np.testing.assert_allclose(sigma_px(confidence, 800.0), 2 * sigma_px(confidence, 400.0))


def test_a_posture_mixes_the_tables():
    seen = np.full(N_JOINTS, 0.9)
    each = [sigma_px(seen, 1.0, posture) for posture in np.eye(5)]
    mixed = sigma_px(seen, 1.0, (0.2, 0.3, 0.1, 0.15, 0.25))
    np.testing.assert_allclose(mixed, np.dot([0.2, 0.3, 0.1, 0.15, 0.25], each))


def test_a_missing_joint_is_no_measurement():
    assert np.isinf(sigma_px(np.zeros(N_JOINTS), 400.0)).all()


@pytest.mark.parametrize("confidence", [0.02, 0.2, 0.5, 0.8, 0.9, 0.99])
@pytest.mark.parametrize(("joint", "kind"), [("nose", 0), ("right_hip", 4), ("left_foot", 7)])
def test_the_kernel_uses_the_same_mapping(confidence, joint, kind):
    ours = error_share(confidence, VISIBILITY, np.ascontiguousarray(ERROR[0, kind]))
    theirs = sigma_px(np.full(N_JOINTS, confidence), 1.0)[JOINT[joint]]
    assert ours == pytest.approx(theirs)
