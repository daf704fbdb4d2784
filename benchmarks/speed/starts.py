"""How long a reset takes: of the single environment, and of some environments of many."""

import time

import gymnasium
import numpy as np

from benchmarks.speed.contenders import OURS

SOME, MANY = 8, 64


class Starts:
    """A single environment and a vector of 64 on one thread, both at level `keypoints`."""

    def __init__(self) -> None:
        self.single = gymnasium.make(OURS, perception="keypoints")
        self.vector = gymnasium.make_vec(OURS, MANY, perception="keypoints", num_threads=1)
        self.single.reset(seed=0)
        self.vector.reset(seed=0)

    def run(self, n_resets: int) -> dict[str, float]:
        """Milliseconds of `reset()` of one, and of 8 of 64 (who they are goes round); means."""
        started_s = time.perf_counter()
        for _ in range(n_resets):
            self.single.reset()
        between_s = time.perf_counter()
        for k in range(n_resets):
            mask = (np.arange(MANY) + k) % (MANY // SOME) == 0
            self.vector.reset(options={"reset_mask": mask})
        seconds = between_s - started_s, time.perf_counter() - between_s
        names = "1_of_1", f"{SOME}_of_{MANY}"
        return {name: 1e3 * each / n_resets for name, each in zip(names, seconds, strict=True)}

    def close(self) -> None:
        """Close the environments."""
        self.single.close()
        self.vector.close()
