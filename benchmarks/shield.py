"""What a shield costs, and how exact its solver is, on the problems that a run poses.

    python -m benchmarks.shield            # prints tables, writes out/shield

Cost: 64 environments at level `keypoints` in two threads, with a stopwatch round the shield, whose
share of the same steps counts. Exactness: QPs of shielded episodes in which a row is exceeded by
what is wanted, solved by `hrc_env.safety.solver` and by daqp with a slack a row.
"""

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import gymnasium
import numpy as np

from benchmarks.common import exactly, publish
from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.core.results import Metric, over
from hrc_env.core.typing import Floats
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Report, table_of
from hrc_env.safety.config import PRESETS
from hrc_env.safety.guard import constraints, guarded, softened
from hrc_env.safety.rows import MOST_ROWS
from hrc_env.safety.solver import exceeded, solve
from hrc_env.simulation import Simulation

OUT = Path("out/shield")
ID, NUM_ENVS, N_STEPS, SEED = "HRCReach-v0", 64, 250, 900_000
N_ROUNDS = 5
Problem = tuple[Floats, Floats, Floats, Floats, Floats, Floats]
"""Rows (m, N), bounds and weights (m,), least and greatest command, what is wanted (N,)."""


class Keeping:
    """The built-in shield "qp", which keeps its problems."""

    def __init__(self) -> None:
        self.problems: list[Problem] = []

    def __call__(self, now: Any, wanted: Floats, dt_s: float) -> Any:
        config = PRESETS["qp"]
        self.problems += posed(now, wanted, dt_s, config)
        return guarded(now, wanted, dt_s, config)


def posed(now: Any, wanted: Floats, dt_s: float, config: Any) -> Iterator[Problem]:
    """The QPs of a step."""
    found, n = constraints(now, wanted, dt_s, config), wanted.shape[1]
    for J, b, count, low, high, asked in zip(*found[:5], wanted, strict=True):
        rows, bound, weight = np.empty((2 * MOST_ROWS, n)), *np.empty((2, 2 * MOST_ROWS))
        m = softened(J, b, count, rows, bound, weight)
        if m and (rows[:m] @ np.clip(asked, low, high) > bound[:m] + 1e-6).any():
            yield rows[:m].copy(), bound[:m].copy(), weight[:m].copy(), low, high, asked


def played(shield: Any, n_steps: int = N_STEPS, num_threads: int = 2) -> tuple[float, float]:
    """Processor time of all threads for steps of the scripted agent [s]; that from actions to what
    the arms are commanded, in which a shield works."""
    envs: Any = gymnasium.make_vec(
        ID, NUM_ENVS, perception="keypoints", people="unaware", shield=shield,
        num_threads=num_threads,
    )  # fmt: skip
    agent = make_agent("scripted", env_info(envs.unwrapped.shards.first))
    seen, _ = envs.reset(seed=SEED)
    for _ in range(3):  # until everything is compiled
        seen, *_ = envs.step(agent.act(seen))
    command, commanding = Simulation._act, list[float]()

    def timed(part: Simulation, action: Any) -> Any:
        started_s = time.thread_time()
        result = command(part, action)
        commanding.append(time.thread_time() - started_s)
        return result

    with patch.object(Simulation, "_act", timed):
        started_s = time.process_time()
        for _ in range(n_steps):
            seen, *_ = envs.step(agent.act(seen))
        seconds = time.process_time() - started_s
    envs.close()
    return seconds, sum(commanding)


def ours(problem: Problem) -> Floats:
    """As the shield solves it."""
    rows, bound, weight, low, high, wanted = problem
    x, n = np.empty(len(wanted)), len(wanted)
    solve(rows, bound, weight, low, high, wanted, x, np.empty((n + 3, n)))
    return x


def reference(problem: Problem) -> Floats:
    """As daqp solves it."""
    import daqp

    rows, bound, weight, low, high, wanted = problem
    m, n = rows.shape
    hessian = np.diag(np.concatenate([np.ones(n), weight]))
    linear = np.concatenate([-wanted, np.zeros(m)])
    upper = np.concatenate([high, np.full(m, 1e30), bound])
    lower = np.concatenate([low, np.zeros(m), np.full(m, -1e30)])
    sides = np.ascontiguousarray(np.hstack([rows, -np.eye(m)]))
    found, _, flag, _ = daqp.solve(hessian, linear, sides, upper, lower, np.zeros(n + 2 * m, "i4"))
    return found[:n] if flag == 1 else np.full(n, np.nan)


def more_exceeded(problem: Problem, x: Floats, best: Floats) -> float:
    """By how much more than at the best a row is exceeded [m/s]."""
    rows, bound, *_ = problem
    over_x, over_best = (max(map(partial(exceeded, x=y), rows, bound)) for y in (x, best))
    return max(over_x, 0.0) - max(over_best, 0.0)


def exactness(n_steps: int) -> dict[str, Metric]:
    """Differences from daqp on the QPs of a run."""
    keeping = Keeping()
    played(keeping, n_steps, num_threads=1)
    problems = keeping.problems
    mine, ours_s = _all(ours, problems)
    best, their_s = _all(reference, problems)
    known = np.isfinite(best).all(1)
    apart = np.abs(mine - best).max(1)[known]
    more = np.array(list(map(more_exceeded, problems, mine, best)))[known]
    n = len(problems)
    metrics = {"daqp.unsolved": exactly(n - known.sum(), "QPs", n)}
    for name, q in (("median", 0.5), ("p95", 0.95), ("worst", 1.0)):
        metrics[f"apart.{name}"] = exactly(np.quantile(apart, q), "rad/s", len(apart))
        metrics[f"exceeded.{name}"] = exactly(1e3 * np.quantile(more, q), "mm/s", len(apart))
    metrics["time.ours"] = exactly(1e6 * ours_s / n, "us", n)
    metrics["time.daqp"] = exactly(1e6 * their_s / n, "us", n)
    return metrics


def _all(solver: Callable[[Problem], Floats], problems: list[Problem]) -> tuple[Floats, float]:
    """Solutions, and processor time [s]."""
    started_s = time.thread_time()
    found = list(map(solver, problems))
    return np.array(found), time.thread_time() - started_s


def cost(n_rounds: int) -> dict[str, Metric]:
    """The shield's share of the processor time of steps [%], in turns with steps without it."""
    shares, slower = [], []
    for _ in range(n_rounds):
        (with_s, commanding_s), (without_s, bare_s) = played("qp"), played(None)
        shares.append(100 * (commanding_s - bare_s) / with_s)
        slower.append(100 * (with_s / without_s - 1))
    return {"cost.share": over(shares, "%"), "cost.slower": over(slower, "%")}


def main() -> None:
    """Measure, print, write."""
    metrics = {**cost(N_ROUNDS), **exactness(N_STEPS)}
    rows = {name: f"{name} [{metric.unit}]" for name, metric in metrics.items()}
    parts = [table_of("", rows, [Column("{}", "value", 4)], metrics)]
    report = Report("The shield", (__doc__ or "").strip(), parts, "least and largest of rounds")
    publish(OUT, report, {"num_envs": NUM_ENVS, "n_steps": N_STEPS}, [SEED], metrics)


if __name__ == "__main__":
    main()
