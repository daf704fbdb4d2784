"""An estimator whose environments depend on each other is refused when it is registered."""

from dataclasses import replace

import numpy as np
import pytest

import hrc_env
from hrc_env.tracking import estimators
from hrc_env.tracking.estimators import ESTIMATORS

BASE = ESTIMATORS["triangulation"]


class Own:
    """Triangulation, in which one thing may be wrong."""

    def __init__(self, P, ctrl_dt, config):
        self.inner, self.config, self.n = BASE.make(P, ctrl_dt, config), config, 0
        for name in ("init", "reset", "predict", "update", "estimate", "forecast"):
            if not hasattr(type(self), name):
                setattr(self, name, getattr(self.inner, name))


class OneGenerator(Own):
    def estimate(self, state):
        return self.inner.estimate(state)

    def update(self, state, keypoints, rngs):
        px = keypoints.px + np.stack([rngs[0].normal(0, 1, each.shape) for each in keypoints.px])
        self.inner.update(state, replace(keypoints, px=px), rngs)


class Mean(Own):
    def estimate(self, state):
        found = self.inner.estimate(state)
        return replace(found, mean_world=found.mean_world + found.mean_world.mean())


class Hidden(Own):
    def update(self, state, keypoints, rngs):
        self.n += 1
        self.inner.update(state, replace(keypoints, px=keypoints.px + self.n), rngs)


class Moving(Own):
    def estimate(self, state):
        self.n += 1
        found = self.inner.estimate(state)
        return replace(found, mean_world=found.mean_world + 0.01 * self.n)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (OneGenerator, "in a batch as alone"),
        (Mean, "in a batch as alone"),
        (Hidden, "keep everything that changes in the state"),
        (Moving, "keep everything that changes in the state|estimate must change nothing"),
    ],
)
def test_an_estimator_whose_environments_depend_on_others_is_refused(made, said):
    with pytest.raises(hrc_env.ConfigError, match=said):
        hrc_env.register_estimator(replace(BASE, name="wrong", make=made))
    assert "wrong" not in ESTIMATORS


@pytest.mark.parametrize("name", [*ESTIMATORS])
def test_estimators_of_the_package_pass(name):
    estimators.check_estimator(ESTIMATORS[name])
    if name == "triangulation":
        estimators.check_estimator(replace(BASE, name="own", make=Own))
