"""List the valid names for arguments, or print the configuration that arguments describe."""

from dataclasses import asdict, dataclass

from rich.console import Console
from rich.table import Table

from hrc_env import IDS
from hrc_env.env_words import EnvironmentArguments


@dataclass(frozen=True, kw_only=True)
class List(EnvironmentArguments):
    """List the valid names for arguments: tasks, perception levels, robots, agents and others."""

    config: tuple[str, ...] | None = None  # type: ignore[assignment]
    """Print the configuration with these changes, if any: FIELD=VALUE or a .toml file."""

    def run(self) -> int:
        """Print the table or the configuration; return the exit status."""
        if self.config is not None:
            return self._show_config()
        from hrc_env.agents import policies  # here: --help imports no simulator
        from hrc_env.agents.registry import AGENTS
        from hrc_env.control import CONTROLS
        from hrc_env.pipeline.levels import LEVELS
        from hrc_env.safety.shield import SHIELDS
        from hrc_env.scene.build import SCENES
        from hrc_env.scene.rig import LAB_CAMERAS
        from hrc_env.scene.robot import ROBOTS
        from hrc_env.tracking.estimators import ESTIMATORS

        table = Table("argument", "names", title="hrc_env")
        known = {
            "id": IDS, "perception": LEVELS, "estimator": ESTIMATORS, "scene": SCENES,
            "robot": ROBOTS, "cameras": [camera.name for camera in LAB_CAMERAS],
            "control": CONTROLS, "shield": SHIELDS,
            "agent": (
                *AGENTS, *policies.list_names(), "a checkpoint: PATH.zip",
                "a policy: PATH.safetensors", "a function: MODULE:FUNCTION",
            ),
        }  # fmt: skip
        for argument, names in known.items():
            table.add_row(argument, ", ".join(names))
        Console().print(table)
        return 0

    def _show_config(self) -> int:
        from hrc_env.core.mapping import convert_to_plain, to_toml
        from hrc_env.settings import resolve_settings

        print(to_toml(convert_to_plain(asdict(resolve_settings(**self.keywords()).config))), end="")
        return 0
