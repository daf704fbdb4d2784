"""Tasks of the robot, with one class in each module; no task reads camera images."""

from dataclasses import dataclass

EPISODE_STEPS = 250
"""Default time limit of an episode [control steps]: 10 s at 25 Hz."""


@dataclass(frozen=True, slots=True)
class BuiltIn:
    """Record of a built-in task, which is available before its module is imported."""

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
"""Built-in tasks by ID."""
DEFAULT = next(iter(BUILT_IN))
"""ID of the default task."""
