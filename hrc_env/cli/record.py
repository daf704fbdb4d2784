"""python -m hrc_env record: an agent's episodes as a data set, by `agents/recording.py`."""

from dataclasses import dataclass
from typing import Annotated

import tyro

import hrc_env
from hrc_env.agents.requests import RecordingRequest
from hrc_env.cli.checks import at_least, writable_folder
from hrc_env.core.errors import ConfigError, check_names
from hrc_env.tasks import DEFAULT


@dataclass(frozen=True, kw_only=True)
class Record(RecordingRequest):
    """Record an agent's episodes as a data set: of Minari, or a folder.

    Finished episodes are kept when this is stopped or killed: the same command goes on there. The
    data set appears when it is whole: with --out where Minari looks for it (MINARI_DATASETS_PATH),
    with --folder there, and hrc_env.load_episodes(FOLDER) reads it.
    """

    task: Annotated[str, tyro.conf.Positional] = DEFAULT
    """Which environment, by its id."""

    def run(self) -> int:
        """Record; a `ConfigError` for a data set that there is, or a name that cannot be one."""
        check_names("environment", [self.task], hrc_env.IDS)
        at_least("--episodes", self.episodes, 1)
        at_least("--num-envs", self.num_envs, 1)
        at_least("--seed", self.seed, 0)
        if self.perception == "pixels":
            raise ConfigError(
                "--perception pixels is too slow to record: record keypoints, which emulates it; "
                "--observe-images 84 84 keeps what the cameras see."
            )
        if (self.out is None) == (self.folder is None):
            raise ConfigError(
                "Say where the data set goes: --out NAME-v0, which Minari loads, or --folder "
                "FOLDER, which hrc_env.load_episodes reads; one of them."
            )
        if self.folder is not None:
            writable_folder(self.folder.absolute().parent, "--folder")
        if self.keypoints and self.perception != "keypoints":
            raise ConfigError(
                f"--keypoints are of cameras, and --perception {self.perception} has none."
            )
        from hrc_env.agents import recording  # here: --help imports no simulator
        from hrc_env.agents.registry import check_agent

        check_agent(self.agent)
        return recording.run(self)
