"""Speed of the environment of each id, relative to that of the default id."""

from collections.abc import Mapping, Sequence

from benchmarks.speed.contenders import MANY, OURS, Vector
from hrc_env.core.results import Metric, over
from hrc_env.tasks import BUILT_IN

WARM_STEPS, THREADS, AT_ONCE = 20, 2, 20
"""Number of warm-up steps, number of threads per vector environment, and number of steps in one
turn.

Turns are short, so that noise of the machine affects all ids equally.
"""


class Tasks:
    """Vector environments of all ids, at `keypoints` with one worker.

    Each consists of 64 environments in two threads.
    """

    def __init__(self) -> None:
        each = {"perception": "keypoints", "num_threads": THREADS, "n_workers": 1}
        self.vectors = {task: Vector(task, MANY, **each) for task in BUILT_IN}
        for vector in self.vectors.values():
            vector.run_steps(WARM_STEPS)

    def run(self, n_steps: int) -> dict[str, float]:
        """Measure the environment steps per second of each id; episodes continue between calls."""
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
    """Compute the speed of each id, and its ratio to that of the default id in the same round.

    The value of each metric is the median over rounds; its interval is the range over rounds.
    """
    found = {f"task_steps_per_s.{task}": over(values, "1/s") for task, values in paces.items()}
    for task, values in paces.items():
        of = [own / ours for own, ours in zip(values, paces[OURS], strict=True)]
        found[f"task_share.{task}"] = over(of, "share")
    return found
