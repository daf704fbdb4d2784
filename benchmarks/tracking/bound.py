"""The posterior Cramer-Rao bound for tracking a whole body.

Tichavsky, Muravchik and Nehorai, IEEE Trans. Signal Processing 46, 1998: the mean squared error of
an estimator is at least the inverse of the Fisher information J, which evolves by

    J' = (A J^-1 A' + Q)^-1 + sum over cameras H'H / sigma^2.

As usual, the transition matrix A, the process noise Q and the measurement matrix H are evaluated at
the true state of each sampled sequence. The recursion is implemented with covariances.
"""

import numpy as np

from benchmarks.tracking.matched import N_PLACES, MatchedModel, transition
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Covariances3, Floats, Points3
from hrc_env.geometry.cameras import project


def camera_information(P: Floats, joints: Points3, seen: Bools, sigma_px: float) -> Covariances3:
    """Return the Fisher information (S, J, 3, 3) of a frame about each joint's position [1/m^2].

    Args:
        P: projection matrices of the cameras (C, 3, 4).
        joints: joint positions (S, J, 3) [m].
        seen: mask (S, C, J) of joints that a camera detects.
        sigma_px: standard deviation of a detection [px].
    """
    px, depth = project(P, joints)
    rows = P[:, None, :2, :3] - px[..., None] * P[:, None, 2:, :3]
    rows = np.where(seen[..., None, None], rows / depth[..., None, None], 0.0)
    return np.einsum("scjki,scjkl->sjil", rows, rows) / sigma_px**2


def posterior_bound(
    P: Floats,
    model: MatchedModel,
    joints: Points3,
    seen: Bools,
    sigma_px: float,
    start_std: tuple[float, float] = (1.5, 1.0),
) -> Covariances3:
    """Return a lower bound (T, S, J, 3, 3) on the covariance of each joint's estimate [m^2].

    Args:
        P: projection matrices of the cameras (C, 3, 4).
        model: motion model.
        joints: joint positions (T, S, J, 3) [m], sampled from the model.
        seen: mask (T, S, C, J) of joints that a camera detects.
        sigma_px: standard deviation of a detection [px].
        start_std: standard deviations of positions [m] and velocities [m/s] before the first frame.
    """
    n_frames, n_sequences = joints.shape[:2]
    start = np.repeat(np.square(start_std), N_PLACES)
    cov = np.tile(np.diag(start), (n_sequences, 1, 1))
    out = np.empty((n_frames, n_sequences, N_JOINTS, 3, 3))
    for t in range(n_frames):
        if t:
            move = transition(model, joints[t - 1])
            cov = move @ cov @ move.swapaxes(1, 2) + model.Q
        cov = _shrink(cov, _block_diagonal(camera_information(P, joints[t], seen[t], sigma_px)))
        out[t] = _joint_blocks(cov)
    return out


def _shrink(cov: Floats, information: Floats) -> Floats:
    """Update covariances (S, n, n) with information (S, m, m) about the first m states."""
    m = information.shape[-1]
    gain = np.linalg.solve(np.eye(m) + information @ cov[:, :m, :m], information)
    after = cov - cov[:, :, :m] @ gain @ cov[:, :m]
    return (after + after.swapaxes(1, 2)) / 2


def _block_diagonal(blocks: Covariances3) -> Floats:
    """Return block-diagonal matrices (S, 45, 45) with the blocks (S, J, 3, 3)."""
    whole = np.zeros((len(blocks), N_JOINTS, 3, N_JOINTS, 3))
    each = np.arange(N_JOINTS)
    whole[:, each, :, each] = blocks.swapaxes(0, 1)
    return whole.reshape(len(blocks), N_PLACES, N_PLACES)


def _joint_blocks(cov: Floats) -> Covariances3:
    """Return the blocks (S, J, 3, 3) of the joints' positions in covariances (S, 90, 90)."""
    places = cov[:, :N_PLACES, :N_PLACES].reshape(len(cov), N_JOINTS, 3, N_JOINTS, 3)
    each = np.arange(N_JOINTS)
    return places[:, each, :, each].swapaxes(0, 1)
