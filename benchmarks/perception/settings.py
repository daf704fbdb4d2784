"""How much the perception bench measures."""

from dataclasses import dataclass

from hrc_env.core.errors import ConfigError
from hrc_env.perception.faults.fault import KINDS
from hrc_env.worker.body import worker_names


@dataclass(frozen=True, slots=True)
class PerceptionBenchConfig:
    """How much is measured."""

    episodes: tuple[tuple[str, int], ...] = (("lab", 30), ("site", 15))
    """Episodes at `pixels`, scene by scene; faults are compared with the lab's first ones."""
    n_steps: int = 250
    """Steps of each."""
    n_faults: int = 8
    """Episodes of every fault at `pixels`; the four cameras have it in turns."""
    fault_steps: int = 150
    """Steps of each."""
    n_emulated: int = 40
    """Episodes of every fault at `keypoints`, of `n_steps` each."""
    kinds: tuple[str, ...] = tuple(KINDS)
    """Which faults."""
    bodies: tuple[str, ...] = worker_names()
    """Whose crops are looked at."""
    n_instants: int = 30
    """Moments of each body in each scene, and of each lens; four crops each."""
    n_empty: int = 1000
    """Steps in each scene without anybody."""
    emulator_rounds: int | None = 4
    """How often each motion is rendered in each scene to hold the emulator against pixels; 0: once,
    in one of them; None: not at all."""
    cameras: tuple[int, ...] = (1, 2, 4)
    """Numbers of cameras whose speed is taken."""
    workers: tuple[int, ...] = (1, 2)
    """Numbers of workers likewise."""
    speed_steps: int = 200
    """Steps by which it is."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for numbers that cannot work."""
        for name in (
            "n_steps", "n_faults", "fault_steps", "n_emulated", "n_instants", "n_empty",
            "speed_steps",
        ):  # fmt: skip
            if getattr(self, name) < 1:
                raise ConfigError(f"{name} must be at least 1, got {getattr(self, name)}.")
        if self.n_faults > dict(self.episodes).get("lab", 0) or self.fault_steps > self.n_steps:
            raise ConfigError(
                "Faults are compared with the lab's first episodes: n_faults must not exceed their "
                f"number nor fault_steps n_steps, got {self.n_faults} and {self.fault_steps}."
            )
        if not self.bodies:
            raise ConfigError(f"bodies must name some of {worker_names()}.")


QUICK = PerceptionBenchConfig(
    episodes=(("lab", 4), ("site", 2)), n_steps=80, n_faults=4, fault_steps=40, n_emulated=8,
    bodies=("worker_1", "worker_2"), n_instants=10, n_empty=40, emulator_rounds=0, speed_steps=30,
)  # fmt: skip
"""Every number, from little."""
