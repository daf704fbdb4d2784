"""python -m hrc_env play: let an agent loose, in the terminal, a film or a window."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import gymnasium
import tyro
from rich.console import Console
from rich.progress import track

import hrc_env
from hrc_env.agents_door import agents
from hrc_env.cli.film import film_episode, table
from hrc_env.env import HRCReachEnv
from hrc_env.errors import unknown
from hrc_env.scene.viewer import Viewer


@dataclass(frozen=True)
class Play:
    """Play episodes of an environment with an agent and say how they went."""

    id: Annotated[str, tyro.conf.Positional] = "HRCReach-v0"
    """Which environment."""
    agent: str = "scripted_slowed"
    """random, scripted, scripted_slowed, or the path of a checkpoint of train.py."""
    perception: str = "pixels"
    """pixels, keypoints, truth or none."""
    estimator: str = "particle"
    """particle, kalman, paper or triangulation."""
    control: str = "joint"
    """joint or tool."""
    n_workers: int = 1
    """Number of workers."""
    episodes: int = 1
    """How many episodes to play."""
    seed: int = 0
    """Seed of the first episode; the next ones count up."""
    video: Path | None = None
    """Film the first episode into this .mp4 file."""
    viewer: bool = False
    """Show the scene in MuJoCo's interactive viewer (needs a display)."""

    def run(self) -> int:
        """Play."""
        if self.id not in hrc_env.IDS:
            raise unknown("environment", self.id, hrc_env.IDS)
        base = agents("base")
        kwargs = {
            "perception": self.perception,
            "estimator": self.estimator,
            "control": self.control,
            "n_workers": self.n_workers,
        }
        if self.video is not None:
            totals = film_episode(
                lambda here: base.make_agent(self.agent, here, self.seed),
                self.video, self.seed, **kwargs,
            )  # fmt: skip
            Console().print(table(totals))
            return 0
        env = gymnasium.make(self.id, **kwargs)
        try:
            for episode in range(self.episodes):
                self._play(env, base, self.seed + episode)
        finally:
            env.close()
        return 0

    def _play(self, env: gymnasium.Env, base: object, seed: int) -> None:
        inner = env.unwrapped
        assert isinstance(inner, HRCReachEnv)
        agent = base.make_agent(self.agent, base.situation(inner.simulation), seed)  # type: ignore[attr-defined]
        observation, info = env.reset(seed=seed)
        window = Viewer(inner.simulation.scene) if self.viewer else None
        started_s, total, steps = time.monotonic(), 0.0, 0
        limit = env.spec.max_episode_steps if env.spec else None
        for _ in track(range(limit or 250), description=f"episode {seed}"):
            observation, reward, terminated, truncated, info = env.step(agent.act(observation))
            total, steps = total + float(reward), steps + 1
            if window is not None:
                window.show(*inner.views.pose())
                due_s = started_s + steps * inner.config.ctrl_dt
                time.sleep(max(0.0, due_s - time.monotonic()))
            if terminated or truncated:
                break
        if window is not None:
            window.close()
        Console().print(
            f"seed {seed}: return {total:.1f}, goals {info['task/goals_reached']:.0f} reached "
            f"{info['task/goals_missed']:.0f} missed, cost {info['episode_cost']:.0f}, "
            f"{steps / (time.monotonic() - started_s):.0f} steps/s"
        )
