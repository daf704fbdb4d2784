"""Watches over the people of a batch of environments: what happens to them, step after step."""

import numpy as np

from hrc_env.core.batching import Stateful
from hrc_env.core.records import RobotState, World
from hrc_env.core.typing import Floats, Ints, Records
from hrc_env.safety import incidents
from hrc_env.safety.robot import RobotModel


class Watch(Stateful):
    """Keeps what episodes have known of each worker."""

    CHANGES = ("known",)

    def __init__(
        self, batch: int, n_workers: int, capsule_names: tuple[str, ...], model: RobotModel,
        dt_s: float,
    ) -> None:  # fmt: skip
        self.known = incidents.nothing_yet(batch, n_workers)
        """(B, W) of `incidents.WATCH`."""
        self.regions, self.model, self.dt_s = incidents.regions_of(capsule_names), model, dt_s

    def reset(self, ids: Ints) -> None:
        """Begin environments `ids` anew."""
        self.known[ids] = incidents.nothing_yet(*self.known[ids].shape)

    def step(self, world: World, paths: incidents.Paths) -> Records:
        """(B, W) of `incidents.INCIDENT`: what happened in a step in which bodies went so."""
        hits_kg, stop_s = np.full(len(self.known), self.model.mass_kg), self.stop_s(world.robot)
        if world.objects is not None:
            hits_kg += world.objects.held @ self.model.load_kg
        return incidents.noted(self.known, paths, self.regions, hits_kg, stop_s, self.dt_s)

    def stop_s(self, robot: RobotState) -> Floats:
        """(B,) how long robots take to stand still [s], as fast as commands may change."""
        return (np.abs(robot.qd) / self.model.slew_rad_s2).max(axis=1)
