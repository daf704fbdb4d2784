"""Solver for the joint velocities nearest to given ones, under soft constraints and box limits.

    minimise |x - wanted|^2 + sum_r w_r max(J_r x - b_r, 0)^2,   low <= x <= high

The problem always has exactly one solution, which is that of the quadratic program with a slack
variable for each constraint. The objective is piecewise quadratic: Newton steps projected on the
box (Bertsekas 1982, DOI 10.1137/0320018) reach the solution in a finite number of iterations.
"""

import math
from typing import NamedTuple

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, JointVelocities

MAX_STEPS = 50
MAX_HALVINGS = 30
TOLERANCE_RAD_S = 1e-9
"""Length of a Newton step below which the solver stops [rad/s]."""


class Problem(NamedTuple):
    """The optimization problem of one robot."""

    J: Floats
    """Rows of the constraints (M, N)."""
    b: Floats
    """Bounds of the constraints (M,)."""
    weight: Floats
    """Weights of squared violations relative to squared changes of joint velocities (M,)."""
    low: JointVelocities
    """Lower bounds on the joint velocities (N,) [rad/s]."""
    high: JointVelocities
    """Upper bounds on the joint velocities (N,) [rad/s]."""
    wanted: JointVelocities
    """Joint velocities of the agent (N,) [rad/s]."""


@kernel
def solve(problem: Problem, x: JointVelocities, scratch: Floats) -> int:
    """Find the nearest joint velocities, and return the number of Newton steps.

    Args:
        problem: objective, constraints and box.
        x: (N,) receives the solution [rad/s].
        scratch: (N + 3, N) working memory.
    """
    low, high, wanted = problem.low, problem.high, problem.wanted
    n = len(x)
    H, g, d, y = scratch[:n], scratch[n], scratch[n + 1], scratch[n + 2]
    for i in range(n):
        x[i] = min(high[i], max(low[i], wanted[i]))
    value = evaluate_objective(problem, x)
    for step in range(MAX_STEPS):
        expand_objective(problem, x, g, H)
        for i in range(n):
            if (x[i] <= low[i] and g[i] > 0.0) or (x[i] >= high[i] and g[i] < 0.0):
                g[i] = 0.0
                for j in range(n):
                    H[i, j] = H[j, i] = 1.0 if i == j else 0.0
        solve_newton_step(H, g, d)
        share, longest = 1.0, 0.0
        for i in range(n):
            longest = max(longest, abs(d[i]))
        if longest < TOLERANCE_RAD_S:
            return step
        for _ in range(MAX_HALVINGS):
            slope = 0.0
            for i in range(n):
                y[i] = min(high[i], max(low[i], x[i] + share * d[i]))
                slope += g[i] * (y[i] - x[i])
            tried = evaluate_objective(problem, y)
            if tried <= value + 1e-4 * slope:
                break
            share *= 0.5
        else:
            return step
        value = tried
        for i in range(n):
            x[i] = y[i]
    return MAX_STEPS


@kernel
def evaluate_objective(problem: Problem, x: Floats) -> float:
    """Return half of the objective for joint velocities `x` (N,)."""
    total = 0.0
    for i in range(len(x)):
        total += (x[i] - problem.wanted[i]) ** 2
    for r in range(len(problem.b)):
        over = constraint_violation(problem.J[r], problem.b[r], x)
        if over > 0.0:
            total += problem.weight[r] * over * over
    return 0.5 * total


@kernel
def constraint_violation(row: Floats, bound: float, x: Floats) -> float:
    """Return `row` . `x` - `bound` for joint velocities `x` (N,); positive if violated."""
    total = -bound
    for i in range(len(x)):
        total += row[i] * x[i]
    return total


@kernel
def expand_objective(problem: Problem, x: Floats, g: Floats, H: Floats) -> None:
    """Compute the gradient `g` (N,) and Hessian `H` (N, N) of half the objective at `x` (N,)."""
    n = len(x)
    for i in range(n):
        g[i] = x[i] - problem.wanted[i]
        for j in range(n):
            H[i, j] = 1.0 if i == j else 0.0
    for r in range(len(problem.b)):
        over = constraint_violation(problem.J[r], problem.b[r], x)
        if over > 0.0:
            for i in range(n):
                stiff = problem.weight[r] * problem.J[r, i]
                g[i] += stiff * over
                for j in range(n):
                    H[i, j] += stiff * problem.J[r, j]


@kernel
def solve_newton_step(H: Floats, g: Floats, d: Floats) -> None:
    """Compute the Newton step `d` = -H^-1 g (N,).

    The Cholesky factor replaces the lower triangle of `H` (N, N).
    """
    n = len(g)
    for i in range(n):
        for j in range(i + 1):
            total = H[i, j]
            for k in range(j):
                total -= H[i, k] * H[j, k]
            H[i, j] = math.sqrt(total) if i == j else total / H[j, j]
    for i in range(n):
        total = -g[i]
        for k in range(i):
            total -= H[i, k] * d[k]
        d[i] = total / H[i, i]
    for i in range(n - 1, -1, -1):
        total = d[i]
        for k in range(i + 1, n):
            total -= H[k, i] * d[k]
        d[i] = total / H[i, i]
