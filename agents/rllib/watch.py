"""Metrics of a training run for Ray's dashboard and Grafana."""

from ray.util.metrics import Counter, Gauge

from .learner import Sampled


class Watch:
    """Gauges and counters of a training run, which Ray exports as `ray_hrc_env_...`.

    Args:
        task: id of the task, used as a tag of the metrics.
    """

    def __init__(self, task: str) -> None:
        tags = {"tag_keys": ("task",)}
        self._rates = {
            "steps_per_s": Gauge("hrc_env_steps_per_s", "Environment steps per second.", **tags),
            "workers": Gauge(
                "hrc_env_workers", "Number of workers that step environments.", **tags
            ),
        }
        self._sums = {
            "steps": Counter("hrc_env_steps", "Number of environment steps.", **tags),
            "episodes": Counter("hrc_env_episodes", "Number of completed episodes.", **tags),
            "contacts": Counter(
                "hrc_env_contacts", "Number of contacts with the true worker.", **tags
            ),
            "goals": Counter("hrc_env_goals", "Number of goals reached.", **tags),
        }
        for each in (*self._rates.values(), *self._sums.values()):
            each.set_default_tags({"task": task})

    def show(self, sampled: Sampled) -> None:
        """Set the metrics from the statistics of an update."""
        facts = sampled.facts()
        for name, gauge in self._rates.items():
            gauge.set(facts[name])
        sums = {
            "steps": float(sampled.n_steps),
            "episodes": float(len(sampled.episodes)),
            "contacts": sum(each["contacts"] for each in sampled.episodes),
            "goals": sum(each["goals_reached"] for each in sampled.episodes),
        }
        for name, value in sums.items():
            if value > 0:
                self._sums[name].inc(value)
