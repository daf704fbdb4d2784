"""Cameras that exchange left and right: noticed over the whole body, and undone.

A two-state hidden Markov model per camera: detections as they are, or mirrored. A camera that comes
back after having seen nothing is believed at first, for the body may have been tracked mirrored in
depth meanwhile; so are several cameras that all seem to be wrong.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import MIRROR
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.measurements import pixel_spread

_MIRROR = tuple(int(j) for j in MIRROR)
_BLIND_UPDATES, _BELIEVED_UPDATES = 8, 5
_ENOUGH, _AGAINST = 3, 5.0
"""So many cameras hardly exchange sides at once, while the others say no more than this against it
(a log-likelihood ratio)."""
_LEAST_CHANCE, _MOST_EVIDENCE = 1e-3, 50.0
_REORDER = {"reassoc", "contract", "nsz"}


@kernel
def undo_swaps(tree, seen, views, s):
    """Mirror what was seen by the cameras that are probably swapped, in place; whether it is rather
    the body that has its sides exchanged, as all of several cameras say.

    `views` (C,) are a hypothesis's records of `tree.state.VIEW`.
    """
    n_seeing, n_swapped, against = 0, 0, 0.0
    for c in range(len(views)):
        sees, view = False, views[c]
        for j in range(len(_MIRROR)):
            sees |= seen.ok[j, c]
        if not sees:
            view.blind += 1
            continue
        back = view.blind > _BLIND_UPDATES
        view.believed = _BELIEVED_UPDATES if back else max(view.believed - 1, 0)
        view.blind = 0
        n_seeing += 1
        if view.believed > 0:
            view.swap_chance = _LEAST_CHANCE
            continue
        prior = view.swap_chance * (1.0 - s.swap_ends) + (1.0 - view.swap_chance) * s.swap_begins
        evidence = _swap_evidence(tree, seen, c, s.inlier_odds)
        odds = math.log(prior / (1.0 - prior)) + evidence
        chance = min(max(1.0 / (1.0 + math.exp(-odds)), _LEAST_CHANCE), 1.0 - _LEAST_CHANCE)
        view.swap_chance = chance
        n_swapped += chance > 0.5
        against -= min(evidence, 0.0)
    mirrored = n_swapped >= _ENOUGH and against < _AGAINST
    if n_swapped == n_seeing > 1 or mirrored:
        for c in range(len(views)):
            views[c].swap_chance = _LEAST_CHANCE
    for c in range(len(views)):
        if views[c].swap_chance > 0.5 and views[c].blind == 0:
            mirror(c, seen.z, seen.sigma, seen.ok)
    return mirrored


@kernel
def _swap_evidence(tree, seen, c, inlier_odds):
    """Log-likelihood ratio of camera c being swapped, bounded."""
    camera, body, cov = seen.P[c], tree.body, tree.cov
    z, sigma, ok = seen.z, seen.sigma, seen.ok
    swapped, right = 1.0, 1.0  # products: no term is more than 1e10
    for j in range(len(_MIRROR)):
        m = _MIRROR[j]
        if m == j or not (ok[j, c] or ok[m, c]):
            continue
        u, v, depth = pixel_of(camera, body[j, 0], body[j, 1], body[j, 2])
        if not depth > NEAREST_DEPTH_M:
            continue
        spread = pixel_spread(camera, u, v, depth, cov[j])
        if ok[m, c]:
            swapped *= _mixture(z[m, c, 0] - u, z[m, c, 1] - v, sigma[m, c], spread, inlier_odds)
        if ok[j, c]:
            right *= _mixture(z[j, c, 0] - u, z[j, c, 1] - v, sigma[j, c], spread, inlier_odds)
    return min(max(math.log(swapped / right), -_MOST_EVIDENCE), _MOST_EVIDENCE)


@kernel(fastmath=_REORDER)
def _mixture(du, dv, sigma, spread, inlier_odds):
    """Density of a detection over that of an outlier, but for a factor that pairs share."""
    near = 1.0 / (sigma * sigma + spread)
    return 1.0 + inlier_odds * near * math.exp(-0.5 * (du * du + dv * dv) * near)


@kernel
def mirror(c, z, sigma, ok):
    """Exchange left and right of camera c, in place."""
    for j in range(len(_MIRROR)):
        m = _MIRROR[j]
        if m > j:
            for i in range(2):
                z[j, c, i], z[m, c, i] = z[m, c, i], z[j, c, i]
            sigma[j, c], sigma[m, c] = sigma[m, c], sigma[j, c]
            ok[j, c], ok[m, c] = ok[m, c], ok[j, c]
