"""Linear assignment of the rows of a cost matrix to different columns, at minimum total cost.

The method is shortest augmenting paths (Jonker and Volgenant, Computing 38, 1987), as a compiled
kernel for matrices with few rows.
"""

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints


@kernel(makes_arrays=True)
def assign_rows(cost: Floats, column: Ints) -> None:
    """Assign each row of a cost matrix to a different column, at minimum total cost.

    Args:
        cost: (n, m) finite costs, with m >= n.
        column: (n,) output: the column assigned to each row.
    """
    n_rows, n_columns = cost.shape
    if n_columns == 1:
        column[:n_rows] = 0
        return
    # Rows and columns count from 1 here; column 0 stands for the row that is being assigned.
    row_price, column_price = np.zeros(n_rows + 1), np.zeros(n_columns + 1)
    owner, before = np.zeros(n_columns + 1, np.int64), np.zeros(n_columns + 1, np.int64)
    least, done = np.empty(n_columns + 1), np.empty(n_columns + 1, np.bool_)
    for row in range(1, n_rows + 1):
        owner[0] = row
        least[:], done[:] = np.inf, False
        here = 0
        while owner[here] != 0:
            done[here] = True
            step, there = np.inf, 0
            for k in range(1, n_columns + 1):
                if done[k]:
                    continue
                reduced = cost[owner[here] - 1, k - 1] - row_price[owner[here]] - column_price[k]
                if reduced < least[k]:
                    least[k], before[k] = reduced, here
                if least[k] < step:
                    step, there = least[k], k
            for k in range(n_columns + 1):
                if done[k]:
                    row_price[owner[k]] += step
                    column_price[k] -= step
                else:
                    least[k] -= step
            here = there
        while here != 0:
            owner[here] = owner[before[here]]
            here = before[here]
    for k in range(1, n_columns + 1):
        if owner[k] > 0:
            column[owner[k] - 1] = k - 1
