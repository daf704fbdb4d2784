"""The nearest joint velocities that keep rows of different softness, inside a hard box.

    minimise |x - wanted|^2 + sum_r w_r max(J_r x - b_r, 0)^2,   low <= x <= high

which always has one solution, and is that of the QP with a slack for each row. It is quadratic in
pieces: Newton's steps, projected on the box (Bertsekas 1982, DOI 10.1137/0320018), end in it.
"""

import math

from hrc_env.core.kernels import kernel

MOST_STEPS = 50
HALVINGS = 30
ENOUGH_RAD_S = 1e-9
"""A step that is shorter than this is the last."""


@kernel
def solve(J, b, weight, low, high, wanted, x, work):
    """Write the solution into `x` (N,); the number of steps.

    Args:
        J: (M, N). b, weight: (M,).
        low, high, wanted: (N,).
        work: (N + 3, N), scratch.
    """
    m, n = len(b), len(x)
    H, g, d, y = work[:n], work[n], work[n + 1], work[n + 2]
    for i in range(n):
        x[i] = min(high[i], max(low[i], wanted[i]))
    value = _value(J, b, weight, m, wanted, x)
    for step in range(MOST_STEPS):
        _model(J, b, weight, m, wanted, x, g, H)
        for i in range(n):
            if (x[i] <= low[i] and g[i] > 0.0) or (x[i] >= high[i] and g[i] < 0.0):
                g[i] = 0.0
                for j in range(n):
                    H[i, j] = H[j, i] = 1.0 if i == j else 0.0
        _newton(H, g, d)
        share, longest = 1.0, 0.0
        for i in range(n):
            longest = max(longest, abs(d[i]))
        if longest < ENOUGH_RAD_S:
            return step
        for _ in range(HALVINGS):
            slope = 0.0
            for i in range(n):
                y[i] = min(high[i], max(low[i], x[i] + share * d[i]))
                slope += g[i] * (y[i] - x[i])
            tried = _value(J, b, weight, m, wanted, y)
            if tried <= value + 1e-4 * slope:
                break
            share *= 0.5
        else:
            return step
        value = tried
        for i in range(n):
            x[i] = y[i]
    return MOST_STEPS


@kernel
def _value(J, b, weight, m, wanted, x):
    """Half of what is minimised."""
    total = 0.0
    for i in range(len(x)):
        total += (x[i] - wanted[i]) ** 2
    for r in range(m):
        over = exceeded(J[r], b[r], x)
        if over > 0.0:
            total += weight[r] * over * over
    return 0.5 * total


@kernel
def exceeded(row, bound, x):
    """row . x - bound."""
    total = -bound
    for i in range(len(x)):
        total += row[i] * x[i]
    return total


@kernel
def _model(J, b, weight, m, wanted, x, g, H):
    """Gradient and curvature."""
    n = len(x)
    for i in range(n):
        g[i] = x[i] - wanted[i]
        for j in range(n):
            H[i, j] = 1.0 if i == j else 0.0
    for r in range(m):
        over = exceeded(J[r], b[r], x)
        if over > 0.0:
            for i in range(n):
                stiff = weight[r] * J[r, i]
                g[i] += stiff * over
                for j in range(n):
                    H[i, j] += stiff * J[r, j]


@kernel
def _newton(H, g, d):
    """d = -H^-1 g by Cholesky's factors, which replace H's lower half."""
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
