"""python -m hrc_env: set up, look, play.

python -m hrc_env demo     a film of a robot that yields to a worker it sees
python -m hrc_env check    is this machine ready?
python -m hrc_env bench    how good and honest are the estimators, how fast is everything?
python -m hrc_env experiment  the paper's experiments, again and further
python -m hrc_env gallery  pictures of every worker, motion and scene
python -m hrc_env calibrate-keypoints  the emulator's errors, fitted to renders
"""

import sys

import tyro
from rich.console import Console
from rich.markup import escape

from hrc_env.cli.bench import Bench
from hrc_env.cli.calibrate import CalibrateKeypoints
from hrc_env.cli.check import Check
from hrc_env.cli.demo import Demo
from hrc_env.cli.experiment import Experiment
from hrc_env.cli.gallery import Gallery
from hrc_env.cli.import_motion import ImportMotion
from hrc_env.cli.listing import List
from hrc_env.cli.play import Play
from hrc_env.cli.setup import Setup
from hrc_env.errors import HRCError


def main() -> int:
    """Run a command; errors that explain themselves are shown without a traceback."""
    command = tyro.extras.subcommand_cli_from_dict(
        {
            "setup": Setup,
            "demo": Demo,
            "check": Check,
            "list": List,
            "play": Play,
            "bench": Bench,
            "experiment": Experiment,
            "gallery": Gallery,
            "import-motion": ImportMotion,
            "calibrate-keypoints": CalibrateKeypoints,
        },
        prog="python -m hrc_env",
        description="A robot, a worker, and the cameras between them.",
        config=(tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes),
    )
    try:
        return command.run()
    except HRCError as error:
        said = f"[bold red]{type(error).__name__}[/]: {escape(str(error))}"
        Console(stderr=True).print(said, highlight=False, soft_wrap=True)
        return 2


if __name__ == "__main__":
    sys.exit(main())
