"""All studies by name, in the order of the report."""

from hrc_env.core.errors import ConfigError, unknown
from hrc_env.experiments.beyond.studies.algorithm1 import ALGORITHM_1
from hrc_env.experiments.beyond.studies.calibration import CALIBRATION
from hrc_env.experiments.beyond.studies.cameras import CAMERAS
from hrc_env.experiments.beyond.studies.filter import FILTER
from hrc_env.experiments.beyond.studies.kinematics import KINEMATICS
from hrc_env.experiments.beyond.studies.latency import LATENCY
from hrc_env.experiments.beyond.studies.occlusion import OCCLUSION
from hrc_env.experiments.beyond.studies.workers import WORKERS
from hrc_env.experiments.beyond.study import Study

STUDIES: dict[str, Study] = {
    study.name: study
    for study in (
        CAMERAS, ALGORITHM_1, LATENCY, CALIBRATION, OCCLUSION, WORKERS, FILTER, KINEMATICS,
    )
}  # fmt: skip


def study_called(name: str) -> Study:
    """A study by name.

    Raises:
        ConfigError: there is none of that name.
    """
    if name not in STUDIES:
        raise unknown("study", name, STUDIES)
    return STUDIES[name]


def check_studies(names: tuple[str, ...]) -> None:
    """Raise `ConfigError` unless these are studies, at least one."""
    if not names:
        raise ConfigError(f"--studies needs a name of {', '.join(STUDIES)}.")
    for name in names:
        study_called(name)
