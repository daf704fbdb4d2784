"""The tree after a set of frames: one exact linear-Gaussian update, then the mean correction.

Cameras inform single joints, bones inform edges, so that the posterior is again a Gaussian on
the same tree: elimination from the leaves to the root and substitution back give its marginals
and slopes exactly.
"""

from hrc_env.core.kernels import kernel
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.measurements import pixel_spread
from hrc_env.tracking.tree.gaussian import PARENT
from hrc_env.tracking.tree.lanes import JOINT_OF_LANE, LANE_OF_JOINT, LANES
from hrc_env.tracking.tree.quads import (
    ABOVE,
    ABOVE_STEP,
    BACK,
    COV,
    DESCENT,
    EDGE,
    GRADIENT,
    HESSIAN,
    INVERSE,
    KNOWN,
    MESSAGE,
    OWN,
    PASSES,
    PROPER,
    PULL,
    PULLED,
    QUAD,
    QUADS,
    SLOPE,
    STEP,
    add_rows,
    apply_rows,
    apply_transposed_rows,
    fetch_above,
    invert_rows,
    multiply_rows,
    multiply_transposed_rows,
    pass_on,
    store_tree,
    subtract_rows,
    transposed_multiply_rows,
)

_NEAREST_M = 0.3
"""The mean correction knows no joint nearer to a lens than this."""
_REORDER = {"reassoc", "contract", "nsz"}


@kernel
def update_tree(body, cov, slope, w):
    """Condition (J, 6), (J, 6, 6), (J, 6, 6) on cameras and bones, in place.

    The tree is in the rows of `w`, and what they say in camera_information, camera_gradient,
    edge_information and edge_gradient, as `tree.search.find_pose` leaves all that. Keeps the
    factors for `shift_to_mean`.
    """
    rows = w.rows
    for quad in range(QUADS):
        _split(rows, quad * QUAD)
    _load_measurements(w, rows)
    for step in range(len(PASSES)):
        _eliminate(rows, PASSES[step][0] * QUAD)
        pass_on(rows, step, MESSAGE, KNOWN, 36)
    root = QUADS - 1
    _eliminate(rows, root * QUAD)
    for n in range(144):
        rows[root * QUAD + COV + n] = rows[root * QUAD + INVERSE + n]
    for n in range(1, len(DESCENT)):
        fetch_above(rows, DESCENT[n], COV, ABOVE, 36)
        _marginalise(rows, DESCENT[n] * QUAD)
    store_tree(rows, COV, cov, slope)
    for j in range(len(body)):
        for i in range(3):
            w.gradient[j, i] = w.camera_gradient[j, i]
            w.gradient[j, 3 + i] = 0.0
    for j in range(len(body)):
        q = PARENT[j]
        if q >= 0:
            for i in range(3):
                w.gradient[j, i] += w.edge_gradient[j, i]
                w.gradient[q, i] -= w.edge_gradient[j, i]
    _substitute(body, w.gradient, rows)


@kernel
def _split(rows, at):
    """What a quad's joints know by themselves, given their parents."""
    multiply_transposed_rows(rows, at + EDGE, at + SLOPE, at + KNOWN)
    subtract_rows(rows, at + COV, at + KNOWN, at + HESSIAN)
    invert_rows(rows, at)
    for n in range(144):
        rows[at + OWN + n] = rows[at + INVERSE + n]
    for lane in range(4):
        if rows[at + PROPER + lane] == 0.0:  # cut the edge rather than believe it
            for n in range(36):
                m = at + lane + 4 * n
                rows[m + SLOPE] = 0.0
                rows[m + OWN] = 1.0 / rows[m + COV] if n % 7 == 0 else 0.0
    multiply_rows(rows, at + OWN, at + SLOPE, at + PULL)
    transposed_multiply_rows(rows, at + SLOPE, at + PULL, at + BACK)


@kernel
def _load_measurements(w, rows):
    """Cameras inform a joint; bones it, its parent and what ties the two."""
    for quad in range(QUADS):
        for n in range(144):
            rows[quad * QUAD + KNOWN + n] = 0.0
    for j in range(len(w.point)):
        at = LANE_OF_JOINT[j] // 4 * QUAD + LANE_OF_JOINT[j] % 4
        for i in range(3):
            for k in range(3):
                m = at + 24 * i + 4 * k
                rows[m + KNOWN] = w.camera_information[j, i, k]
                if PARENT[j] >= 0:
                    rows[m + OWN] += w.edge_information[j, i, k]
                    rows[m + PULL] += w.edge_information[j, i, k]
                    rows[m + BACK] += w.edge_information[j, i, k]


@kernel
def _eliminate(rows, at):
    """Posterior slopes and inverse Hessians of a quad, and what its joints tell their parents."""
    add_rows(rows, at + OWN, at + KNOWN, at + HESSIAN)
    invert_rows(rows, at)
    multiply_rows(rows, at + INVERSE, at + PULL, at + SLOPE)
    transposed_multiply_rows(rows, at + PULL, at + SLOPE, at + EDGE)
    subtract_rows(rows, at + BACK, at + EDGE, at + MESSAGE)


@kernel
def _marginalise(rows, at):
    """C_j = inverse Hessian + B_j C_parent B_j'."""
    multiply_rows(rows, at + SLOPE, at + ABOVE, at + EDGE)
    multiply_transposed_rows(rows, at + EDGE, at + SLOPE, at + MESSAGE)
    add_rows(rows, at + MESSAGE, at + INVERSE, at + COV)


@kernel
def _substitute(body, gradient, rows):
    """Add to the means what a gradient (J, 6) asks for, by the factors of the elimination."""
    for lane in range(LANES):
        j = JOINT_OF_LANE[lane]
        at = lane // 4 * QUAD + lane % 4 + GRADIENT
        for i in range(6):
            rows[at + 4 * i] = gradient[j, i] if j >= 0 else 0.0
    for step in range(len(PASSES)):
        at = PASSES[step][0] * QUAD
        apply_transposed_rows(rows, at + SLOPE, at + GRADIENT, at + PULLED)
        pass_on(rows, step, PULLED, GRADIENT, 6)
    for n in range(len(DESCENT)):
        at = DESCENT[n] * QUAD
        fetch_above(rows, DESCENT[n], STEP, ABOVE_STEP, 6)
        apply_rows(rows, at + SLOPE, at + ABOVE_STEP, at + PULLED)
        apply_rows(rows, at + INVERSE, at + GRADIENT, at + STEP)
        for i in range(24):
            rows[at + STEP + i] += rows[at + PULLED + i]
    for j in range(len(body)):
        at = LANE_OF_JOINT[j] // 4 * QUAD + LANE_OF_JOINT[j] % 4 + STEP
        for i in range(6):
            body[j, i] += rows[at + 4 * i]


@kernel
def shift_to_mean(body, cov, slope, seen, belief, share, w):
    """Lead the means from the mode towards the mean of the posterior (Laplace's next term).

    A camera's information on a position falls with the square of the depth, so that there is
    more room behind the mode than before it. With J the Jacobian of joint j's pixel, n the
    camera's optical axis (both in the world), d the depth and S_j the posterior covariance,
    mean - mode = H^-1 g with g_j = sum over cameras of n tr(S_j J'J / sigma^2) / d, H being the
    Hessian of all joints, whose factors `update_tree` left. `share` of it is applied.
    """
    P, _, sigma, ok = seen
    for j in range(len(ok)):
        for i in range(6):
            w.gradient[j, i] = 0.0
        for c in range(len(P)):
            if not (ok[j, c] and belief[j, c] > 0.0):
                continue
            p = P[c]
            u, v, depth = pixel_of(p, w.point[j, 0], w.point[j, 1], w.point[j, 2])
            if not depth > NEAREST_DEPTH_M:
                continue
            variance = 2.0 * pixel_spread(p, u, v, depth, cov[j])
            pull = share * belief[j, c] * variance / sigma[j, c] ** 2 / max(depth, _NEAREST_M)
            for i in range(3):
                w.gradient[j, i] += pull * p[2, i]
    _substitute(body, w.gradient, w.rows)
