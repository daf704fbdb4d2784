"""What is called otherwise now: asking by an old name is answered with the new one."""

from typing import Any

OLD_NAMES = {
    "beyond": "ablations",
    "--peers": "--baselines",
    "eyes": "detector",
    "horizons_s": "forecast_s",
    "per_joint": "particle",
    "processes": "threads",
    "reward.goal": "task.goal_bonus",
    "reward.progress_per_m": "task.progress_per_m",
    "scene.leash_rad": "scene.integrator_clamp_rad",
    "tracker.paper_iterations": "tracker.n_iterations",
    "tracker.paper_particles": "tracker.n_particles",
    "tracker.paper_resampling": "tracker.resampling",
    "tracker.paper_sigma_m": "tracker.sigma_m",
    "worker_gap": "worker_separation",
    "worker_joints_ahead": "worker_joints_forecast",
    "worker_joints_ahead_std": "worker_joints_forecast_std",
}
"""Fields of the config by their path, arguments, their values, commands, "--options",
observation terms and keys of the infos."""


class Named(dict[str, Any]):
    """Values by name; an old name is answered with the new one."""

    def __missing__(self, name: str) -> Any:
        new = f": it is called {OLD_NAMES[name]!r} now" if name in OLD_NAMES else ""
        raise KeyError(f"{name}{new}")
