"""The bootstrap filter of the library particles, one for each joint (N. Chopin, MIT)."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.tracking.baselines.model import START_COV, F, Q, first_joints, pixels
from benchmarks.tracking.rigs import SIGMA_PX
from hrc_env.core.typing import Floats, Points2, Points3

N_PARTICLES = 1000
FREEDOM = 3.0
"""Degrees of freedom of the Student t distribution of pixels, which has heavy tails.

Heavy tails represent gross errors. With a constant outlier density instead, particles for which all
pixels are outliers would drift away.
"""


def follow(P: Floats, px: Points2, seed: int) -> Points3:
    """Estimate joints (T, J, 3) from pixels (T, C, J, 2)."""
    start = first_joints(P, px)
    with _seed(seed):
        joints = [_one_joint(P, px[:, :, j], start[j]) for j in range(px.shape[2])]
    return np.stack(joints, axis=1)


@contextmanager
def _seed(seed: int) -> Iterator[None]:
    """Seed NumPy's global generator, which the library uses, and restore its state afterwards."""
    before = np.random.get_state()  # noqa: NPY002
    np.random.seed(seed)  # noqa: NPY002
    try:
        yield
    finally:
        np.random.set_state(before)  # noqa: NPY002


def _one_joint(P: Floats, px: Points2, start: Points3) -> Points3:
    """Estimate the positions (T, 3) of a joint from pixels (T, C, 2)."""
    particles = import_module("particles")
    moments = import_module("particles.collectors").Moments()
    model = import_module("particles.state_space_models").Bootstrap(
        ssm=_joint_model(P, start), data=list(px)
    )
    smc = particles.SMC(fk=model, N=N_PARTICLES, resampling="systematic", collect=[moments])
    smc.run()
    return np.stack([moment["mean"][:3] for moment in smc.summaries.moments])


def _joint_model(P: Floats, start: Points3) -> Any:
    """Return the state-space model as a class of the library."""
    distributions = import_module("particles.distributions")
    models = import_module("particles.state_space_models")

    class Pixels(distributions.ProbDist):
        """Student t distribution of the pixels in the cameras that detect the joint."""

        dim = 2 * len(P)

        def __init__(self, expected: Points2) -> None:
            self.expected = expected

        def logpdf(self, x: Points2) -> Floats:
            off = (x.ravel() - self.expected).reshape(*self.expected.shape[:-1], -1, 2)
            squared = (off**2).sum(-1) / SIGMA_PX**2
            density = -0.5 * (FREEDOM + 2) * np.log1p(squared / FREEDOM)
            return np.where(np.isfinite(density), density, 0.0).sum(-1)

    class Joint(models.StateSpaceModel):
        """State-space model of a joint that moves with constant velocity."""

        def PX0(self) -> Any:  # noqa: N802
            return distributions.MvNormal(loc=np.concatenate([start, np.zeros(3)]), cov=START_COV)

        def PX(self, t: int, xp: Floats) -> Any:  # noqa: N802
            return distributions.MvNormal(loc=xp @ F.T, cov=Q)

        def PY(self, t: int, xp: Floats, x: Floats) -> Any:  # noqa: N802
            return Pixels(pixels(P, x[:, :3]))

    return Joint()
