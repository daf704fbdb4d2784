"""hrc_env: learn to work beside people whom a robot sees through cameras only.

Importing this package registers the environments; `gymnasium.make("hrc_env:HRCReach-v0")`
does both. See `hrc_env.env` for the arguments and `hrc_env.config` for everything else.
"""

from gymnasium.envs.registration import register

__version__ = "0.1.0"

IDS = ("HRCReach-v0",)

register(
    id="HRCReach-v0",
    entry_point="hrc_env.env:HRCReachEnv",
    vector_entry_point="hrc_env.vector.factory:make_vector",
    max_episode_steps=250,  # 10 s at 25 Hz
)
