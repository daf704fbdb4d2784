"""Pairs of eyes: an estimator, cameras, how late images are, and what is wrong with all that."""

import math
from collections.abc import Collection
from dataclasses import dataclass

from hrc_env.core.errors import check_names
from hrc_env.experiments.rigs import Turn
from hrc_env.experiments.setups import LATE_S, PerceptionSetup
from hrc_env.perception.faults.fault import ALL, FOREVER_S, FaultConfig
from hrc_env.scene.rigs import RIGS
from hrc_env.tracking.estimators import ESTIMATORS

Faults = tuple[FaultConfig, ...]
TRUTH, FOUR, ONE = "truth", "particle", "one_camera"


@dataclass(frozen=True, slots=True)
class Eyes:
    """How a robot sees, and how sure it says it is."""

    name: str
    """As in results.json."""
    words: str
    """As in tables and figures."""
    group: str
    """What it is a case of: one of `GROUPS`."""
    setup: PerceptionSetup
    wrong: tuple[Faults, ...] = ((),)
    """What goes wrong with cameras beside what the setup says; episodes take turns in these."""
    covariance: float = 1.0
    """The shield is told so many times the estimator's covariances."""

    def turns(self, scene: str) -> tuple[Turn, ...]:
        """Cameras and their faults, in which episodes take turns; in other scenes than the setup's
        own the scene's cameras, of which as many are left."""
        turns = self.setup.list_turns(RIGS[scene])
        return tuple(
            Turn(turn.cameras, (*turn.faults, *more)) for turn in turns for more in self.wrong
        )


GROUPS = {
    "truth": "true joints", "estimator": "estimators", "cameras": "fewer cameras",
    "latency": "late images", "calibration": "miscalibrated cameras",
    "covariance": "covariances that are too small or too large", "fault": "faults",
}  # fmt: skip
"""By name, in words."""


def _every(
    kind: str, amount: float | None, from_s: float = 0.0, until_s: float = FOREVER_S
) -> tuple[Faults, ...]:
    return ((FaultConfig(kind, (ALL,), amount, from_s, until_s),),)


def _each(kind: str, amount: float | None = None, from_s: float = 0.0) -> tuple[Faults, ...]:
    return tuple((FaultConfig(kind, (camera.name,), amount, from_s),) for camera in RIGS["lab"])


def _late(latency_s: float, told: bool) -> Eyes:
    ms = round(1000 * latency_s)
    says = "known" if told else "not known"
    return Eyes(
        f"late_{ms}ms{'' if told else '_untold'}", f"images {ms} ms late, {says}",
        "latency", PerceptionSetup(latency_s=latency_s, is_told=told),
    )  # fmt: skip


def all_eyes() -> dict[str, Eyes]:
    """By name, with every estimator that is registered now, each with four cameras."""
    four, one, degree = PerceptionSetup(), PerceptionSetup(n_cameras=1), math.radians(1.0)
    estimators = (
        Eyes(each, f"four cameras, {each}", "estimator", PerceptionSetup(estimator=each))
        for each in ESTIMATORS
    )
    wrong = (
        ("all_turned_1deg", "all cameras turned by 1 degree", _every("wrong_rotation", degree)),
        ("all_turned_0_3deg", "all turned by .3 degrees", _every("wrong_rotation", 0.3 * degree)),
        ("all_moved_10cm", "all cameras moved by 10 cm", _every("wrong_translation", 0.1)),
        ("one_turned_3deg", "one camera turned by 3 degrees", _each("wrong_rotation", 3 * degree)),
        ("one_knocked", "one camera knocked over after 2 s", _each("knocked", None, 2.0)),
    )
    faults = (
        ("dropped_60", "60 % of images missing", _every("dropped", 0.6)),
        ("one_frozen", "one camera frozen after 2 s", _each("frozen", None, 2.0)),
        ("blind_3s", "all cameras lost from 3 to 6 s", _every("lost", None, 3.0, 6.0)),
    )  # fmt: skip
    scaled = (
        (f"{name}{key}", f"{words}, reports {says} its variance", setup, factor)
        for name, words, setup in (("", "four cameras", four), ("one_camera_", "one camera", one))
        for key, says, factor in (
            ("half_covariance", "half", 0.5),
            ("twice_covariance", "twice", 2),
        )
    )
    found = (
        Eyes(TRUTH, "true joints", "truth", PerceptionSetup("truth")),
        *estimators,
        Eyes("three_cameras", "three cameras", "cameras", PerceptionSetup(n_cameras=3)),
        Eyes("two_cameras", "two cameras", "cameras", PerceptionSetup(n_cameras=2)),
        Eyes(ONE, "one camera", "cameras", one),
        *(_late(s, told) for told in (True, False) for s in LATE_S),
        *(Eyes(name, words, "calibration", four, each) for name, words, each in wrong),
        *(Eyes(n, words, "covariance", setup, covariance=k) for n, words, setup, k in scaled),
        *(Eyes(name, words, "fault", four, each) for name, words, each in faults),
    )
    return {eyes.name: eyes for eyes in found}


QUICK = (
    TRUTH, FOUR, "paper_restarts", "triangulation", "three_cameras", "two_cameras", ONE,
    "late_120ms", "late_200ms", "late_200ms_untold", "all_turned_1deg", "half_covariance",
)  # fmt: skip
"""Twelve that answer every question; the picture shows these."""
ELSEWHERE = (TRUTH, FOUR, ONE)
"""Of every other task."""
ON_REQUEST = ("kalman", "paper")
"""With four cameras `kalman` equals the default; `paper` takes minutes an episode."""


def usual_eyes() -> tuple[str, ...]:
    """The names of those that are compared if nobody asks for others."""
    return tuple(name for name in all_eyes() if name not in ON_REQUEST)


def eyes_called(names: Collection[str]) -> list[Eyes]:
    """Eyes by name, or a `ConfigError`."""
    known = all_eyes()
    check_names("eyes", names, known)
    return [known[name] for name in names]
