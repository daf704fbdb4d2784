"""python -m hrc_env list: the names that arguments take."""

from dataclasses import dataclass

from rich.console import Console
from rich.table import Table

from hrc_env import IDS
from hrc_env.core.checkout import agents


@dataclass(frozen=True)
class List:
    """Environments, perception levels, estimators, scenes, cameras and agents by name."""

    def run(self) -> int:
        """Print the table."""
        from hrc_env.control import CONTROLS  # here: --help imports no simulator
        from hrc_env.pipeline.levels import LEVELS
        from hrc_env.scene.build import SCENES
        from hrc_env.scene.rig import LAB_CAMERAS
        from hrc_env.scene.robot import ROBOTS
        from hrc_env.tracking.estimators import ESTIMATORS

        table = Table("argument", "names", title="hrc_env")
        cameras = [camera.name for camera in LAB_CAMERAS]
        for argument, names in (
            ("id", IDS),
            ("perception", LEVELS),
            ("estimator", ESTIMATORS),
            ("scene", SCENES),
            ("robot", ROBOTS),
            ("cameras", cameras),
            ("control", CONTROLS),
            ("agent", (*agents("registry").AGENTS, "a checkpoint: PATH.zip")),
        ):
            table.add_row(argument, ", ".join(names))
        Console().print(table)
        return 0
