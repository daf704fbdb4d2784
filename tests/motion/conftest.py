"""A recording that several tests look at."""

from types import SimpleNamespace

import numpy as np
import pytest
from recorded import DT_S, joined, started

from hrc_env.motion import generator


@pytest.fixture(scope="session")
def shift():
    """200 s of eight workers' behaviour at 50 Hz: motion, and what they did (B, T)."""
    state, rngs = started(8, seed=1)
    motions, doing = [], []
    for _ in range(int(200 / DT_S)):
        motions.append(generator.advance(state, rngs, DT_S, 1)[1])
        doing.append(generator.activity(state)[:, 0])
    return SimpleNamespace(motion=joined(motions), doing=np.stack(doing, 1), dt_s=DT_S)
