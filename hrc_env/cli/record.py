"""Record an agent's episodes as a data set; `agents/recording.py` does the work."""

from dataclasses import dataclass
from typing import Annotated

import tyro

import hrc_env
from hrc_env.agents.requests import RecordingRequest
from hrc_env.cli.checks import check_at_least, check_writable_folder
from hrc_env.core.errors import ConfigError, check_names
from hrc_env.tasks import DEFAULT


@dataclass(frozen=True, kw_only=True)
class Record(RecordingRequest):
    """Record an agent's episodes as a Minari data set or in a folder.

    If the command is stopped or killed, finished episodes are kept, and the same command continues
    the recording. The data set appears when it is complete: with --out, in the folder of Minari's
    data sets (MINARI_DATASETS_PATH); with --folder, in that folder, from which
    hrc_env.load_episodes(FOLDER) reads it.
    """

    task: Annotated[str, tyro.conf.Positional] = DEFAULT
    """Id of the environment."""

    def run(self) -> int:
        """Record the episodes; return the exit status.

        Raises:
            ConfigError: the data set exists already, its name is invalid, or options contradict
                each other.
        """
        check_names("environment", [self.task], hrc_env.IDS)
        check_at_least("--episodes", self.episodes, 1)
        check_at_least("--num-envs", self.num_envs, 1)
        check_at_least("--seed", self.seed, 0)
        if self.perception == "pixels":
            raise ConfigError(
                "--perception pixels is too slow for recording: use --perception keypoints, which "
                "emulates it; --observe-images 84 84 records the camera images."
            )
        if (self.out is None) == (self.folder is None):
            raise ConfigError(
                "A data set needs exactly one destination: --out NAME-v0, for Minari, or --folder "
                "FOLDER, for hrc_env.load_episodes."
            )
        if self.folder is not None:
            check_writable_folder(self.folder.absolute().parent, "--folder")
        if self.keypoints and self.perception != "keypoints":
            raise ConfigError(
                f"--keypoints requires cameras, but --perception {self.perception} has none."
            )
        from hrc_env.agents import recording  # here: --help imports no simulator
        from hrc_env.agents.registry import check_agent

        check_agent(self.agent)
        return recording.run(self)
