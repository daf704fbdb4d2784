"""Weights of particles, in logarithms."""

import numpy as np
from simulated import LAB

from hrc_env.tracking.paper import add_log_likelihood, normalise


def test_a_flat_likelihood_leaves_the_weights_alone():
    particles = np.random.default_rng(0).uniform(0.0, 1.0, (3, 100))
    log_weights = np.log(np.linspace(1, 2, 100))
    before, weights = log_weights.copy(), np.empty(100)
    add_log_likelihood(LAB[0], 900.0, 500.0, 1e9, particles, log_weights)
    np.testing.assert_allclose(log_weights, before, atol=1e-9)
    normalise(log_weights, weights)
    np.testing.assert_allclose(weights, np.linspace(1, 2, 100) / 150, atol=1e-9)


def test_likelihoods_too_small_for_a_float_still_compare():
    weights = np.empty(3)
    normalise(np.array([-5000.0, -5000.0, -9000.0]), weights)
    np.testing.assert_allclose(weights, [0.5, 0.5, 0.0])


def test_a_particle_behind_the_camera_loses_to_any_before_it():
    particles = np.array([[0.5, 9.0], [0.0, 8.0], [1.0, 2.6]])
    log_weights, weights = np.zeros(2), np.empty(2)
    add_log_likelihood(LAB[0], 9e4, 9e4, 1.0, particles, log_weights)
    normalise(log_weights, weights)
    assert weights[0] == 1.0
