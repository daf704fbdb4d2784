"""What is told of a Gaussian on the tree: each joint for itself, no more certain than is honest."""

from hrc_env.core.kernels import kernel
from hrc_env.tracking.tracks import bound

_FORGOTTEN_UPDATES = 8
"""A camera that has not seen the worker for longer no longer counts as a view of them."""


@kernel
def report_moments(tree, b, out, w):
    """Mean, velocity and covariance of a hypothesis, to be those of worker w."""
    mean, cov, velocity = out[0][b, w], out[1][b, w], out[2][b, w]
    for j in range(len(mean)):
        for i in range(3):
            mean[j, i], velocity[j, i] = tree.body[j, i], tree.body[j, 3 + i]
            for h in range(3):
                cov[j, i, h] = tree.cov[j, i, h]


@kernel
def report_rest(tree, views, b, s, out, w):
    """Ages and the track of a hypothesis, and how certain worker w's joints are allowed to be.

    Of a worker whom one camera alone sees lately they are less certain: their errors have
    heavier tails than a Gaussian's.
    """
    cov, age, n_views = out[1][b, w], out[3][b, w], 0
    tracked = tree.tracked
    for c in range(len(views)):
        n_views += views[c].blind <= _FORGOTTEN_UPDATES
    factor = s.one_view_inflation if tracked and n_views == 1 else 1.0
    for j in range(len(cov)):
        age[j] = tree.age_s[j]
        for i in range(3):
            for h in range(3):
                cov[j, i, h] *= factor
    bound(cov, s.min_std_m, s.prior_std_m)
    out[4][b, w] = tracked
