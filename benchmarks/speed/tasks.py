"""The speed of every id relative to the default id, with the same interface and in turns."""

from collections.abc import Mapping, Sequence

from benchmarks.speed.contenders import MANY, OURS, Vector
from hrc_env.core.results import Metric, over
from hrc_env.tasks import BUILT_IN

WARM_STEPS, THREADS, AT_ONCE = 20, 2, 20
"""Steps before the measurement, threads of the environments of an id, and steps of one turn.

Turns are short, to let noise of the machine affect all ids equally.
"""


class Tasks:
    """A vector of 64 environments on two threads for every id, at `keypoints` with one worker."""

    def __init__(self) -> None:
        each = {"perception": "keypoints", "num_threads": THREADS, "n_workers": 1}
        self.vectors = {task: Vector(task, MANY, **each) for task in BUILT_IN}
        for vector in self.vectors.values():
            vector.run_steps(WARM_STEPS)

    def run(self, n_steps: int) -> dict[str, float]:
        """Measure environment steps per second by id; episodes continue between calls."""
        paces: dict[str, tuple[int, float]] = dict.fromkeys(self.vectors, (0, 0.0))
        for _ in range(0, n_steps, AT_ONCE):
            for task, vector in self.vectors.items():
                pace, (steps, seconds) = vector.run_steps(min(AT_ONCE, n_steps)), paces[task]
                paces[task] = steps + pace.env_steps, seconds + pace.seconds
        return {task: steps / seconds for task, (steps, seconds) in paces.items()}

    def close(self) -> None:
        """Close the environments."""
        for vector in self.vectors.values():
            vector.close()


def shares(paces: Mapping[str, Sequence[float]]) -> dict[str, Metric]:
    """Compute the speeds of ids, and their ratios to that of the default id in the same round.

    Each metric is the median over rounds, with the minimum and the maximum.
    """
    found = {f"task_steps_per_s.{task}": over(values, "1/s") for task, values in paces.items()}
    for task, values in paces.items():
        of = [own / ours for own, ours in zip(values, paces[OURS], strict=True)]
        found[f"task_share.{task}"] = over(of, "share")
    return found
