"""The nearest joint velocities: beside another solver, and by what they must be."""

import numpy as np
import pytest

from hrc_env.safety.solver import MAX_STEPS, Problem, solve

N, MOST = 6, 40


def problem(seed):
    """Rows as of two bodies near an arm: many nearly the same, some asking to get away."""
    rng = np.random.default_rng(seed)
    m, few = int(rng.integers(1, MOST + 1)), rng.normal(0, 0.5, (4, N))
    J = few[rng.integers(0, 4, m)] + rng.normal(0, 0.1, (m, N))
    b = rng.uniform(-0.6, 0.8, m)
    weight = np.where(b < 0, rng.choice([30.0, 1e4], m), 1e4)
    middle = rng.uniform(-0.8, 0.8, N)
    return J, b, weight, middle - 0.32, middle + 0.32, rng.uniform(-1.5, 1.5, N)


def solved(J, b, weight, low, high, wanted):
    x, n = np.empty(len(wanted)), len(wanted)
    problem = Problem(J, b, weight, low, high, wanted)
    steps = solve(problem, x, np.empty((n + 3, n)))
    return x, steps


def value(J, b, weight, wanted, x):
    return np.square(x - wanted).sum(-1) + np.maximum(x @ J.T - b, 0.0) ** 2 @ weight


@pytest.mark.parametrize("seed", range(8))
def test_nothing_within_reach_is_better(seed):
    J, b, weight, low, high, wanted = problem(seed)
    x, steps = solved(J, b, weight, low, high, wanted)
    assert steps < MAX_STEPS
    assert ((low <= x) & (x <= high)).all()
    rng = np.random.default_rng(seed)
    near = np.clip(x + rng.normal(0, 1e-3, (2000, N)), low, high)
    others = np.concatenate([near, rng.uniform(low, high, (2000, N))])
    assert value(J, b, weight, wanted, x) <= value(J, b, weight, wanted, others).min() + 1e-12


def test_it_is_that_of_another_solver():
    daqp = pytest.importorskip("daqp")
    for seed in range(200):
        J, b, weight, low, high, wanted = problem(seed)
        m = len(b)
        hessian = np.diag(np.concatenate([np.ones(N), weight]))
        rows = np.ascontiguousarray(np.hstack([J, -np.eye(m)]))
        upper = np.concatenate([high, np.full(m, 1e30), b])
        lower = np.concatenate([low, np.zeros(m), np.full(m, -1e30)])
        linear = np.concatenate([-wanted, np.zeros(m)])
        found, _, flag, _ = daqp.solve(
            hessian, linear, rows, upper, lower, np.zeros(N + 2 * m, "i4")
        )
        assert flag == 1
        np.testing.assert_allclose(solved(J, b, weight, low, high, wanted)[0], found[:N], atol=1e-4)


def test_one_row_is_kept_by_the_shortest_change():
    row, wanted = np.array([[0.6, 0.8]]), np.array([1.0, 1.0])
    box = np.full(2, -9.0), np.full(2, 9.0)
    x, _ = solved(row, np.array([0.4]), np.array([1e8]), *box, wanted)
    np.testing.assert_allclose(x, wanted - row[0], atol=1e-6)


def test_what_cannot_be_kept_is_kept_as_far_as_it_can():
    """Nearer than the first allows is worse than not getting away, which cannot be reached."""
    rows = np.array([[1.0, 0.0], [-1.0, 0.0]])
    x, _ = solved(
        rows,
        np.array([0.0, -0.5]),
        np.array([1e4, 30.0]),
        *np.full((2, 2), 9.0) * [[-1], [1]],
        np.zeros(2),
    )
    assert 0.0 <= x[0] < 2e-3
