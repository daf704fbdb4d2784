"""hrc_env: learn to work beside people whom a robot sees through cameras only.

Importing this package registers the environments; `gymnasium.make("hrc_env:HRCReach-v0")`
does both. See `hrc_env.env` for the arguments, `hrc_env.config` for everything else, and
`hrc_env.registration` for tasks, estimators and more of your own.
"""

from hrc_env.registration import (
    IDS,
    adopt,
    import_files,
    register_detector,
    register_environment,
    register_estimator,
    register_robot,
    register_shield,
    register_task,
)
from hrc_env.tasks import BUILT_IN

__version__ = "0.1.0"
__all__ = [
    "IDS",
    "register_detector",
    "register_estimator",
    "register_robot",
    "register_shield",
    "register_task",
]

for _id, _task in BUILT_IN.items():
    register_environment(_id, _task.max_episode_steps)
import_files()
adopt()
