"""Tasks of the robot, one class a file. None of them reads a camera."""

from dataclasses import dataclass

EPISODE_STEPS = 250
"""Time limit of an episode unless its task has another one [control steps]: 10 s at 25 Hz."""


@dataclass(frozen=True, slots=True)
class BuiltIn:
    """A task of the package, known before its file is imported."""

    path: str
    """Module and class of the task, as "module:class"."""
    max_episode_steps: int = EPISODE_STEPS
    """Time limit of an episode [control steps]."""


BUILT_IN = {
    "HRCReach-v0": BuiltIn("hrc_env.tasks.reach:Reach"),
    "HRCPickPlace-v0": BuiltIn("hrc_env.tasks.pick_place:PickPlace", 750),
    "HRCDelivery-v0": BuiltIn("hrc_env.tasks.delivery:Delivery", 1000),
    "HRCDrywall-v0": BuiltIn("hrc_env.tasks.drywall:Drywall", 1000),
    "HRCHandover-v0": BuiltIn("hrc_env.tasks.handover:Handover", 750),
    "HRCReachGoal-v0": BuiltIn("hrc_env.tasks.reach_goal:ReachGoal", 100),
    "HRCPickPlaceGoal-v0": BuiltIn("hrc_env.tasks.pick_place_goal:PickPlaceGoal", 750),
}
"""The package's tasks by their ids."""
DEFAULT = next(iter(BUILT_IN))
"""Id of the task that is taken where none is given."""
