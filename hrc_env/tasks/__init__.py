"""Tasks: what the robot is to achieve. One file per task makes one `Task`; none reads a camera."""

BUILT_IN = {
    "HRCReach-v0": "hrc_env.tasks.reach",
    "HRCPickPlace-v0": "hrc_env.tasks.pick_place",
    "HRCDelivery-v0": "hrc_env.tasks.delivery",
    "HRCDrywall-v0": "hrc_env.tasks.drywall",
    "HRCHandover-v0": "hrc_env.tasks.handover",
    "HRCReachGoal-v0": "hrc_env.tasks.reach_goal",
    "HRCPickPlaceGoal-v0": "hrc_env.tasks.pick_place_goal",
}
"""Id and file of each task that comes with the package; the file's `TASK` is imported at need."""
DEFAULT = next(iter(BUILT_IN))
EPISODE_STEPS = 250
"""An episode's time limit, unless a task's file says otherwise: 10 s at 25 Hz."""
LONGER = {
    "HRCPickPlace-v0": 750,
    "HRCDelivery-v0": 1000,
    "HRCDrywall-v0": 1000,
    "HRCHandover-v0": 750,
    "HRCReachGoal-v0": 100,
    "HRCPickPlaceGoal-v0": 750,
}
"""Those of built-in tasks that do, known before their files are imported."""
