"""Perception setups of the price study, with their estimators, cameras, latency and faults."""

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
"""Faults of one episode."""
TRUTH, FOUR, ONE = "truth", "particle", "one_camera"
"""Names of setups: the truth, four cameras with the default estimator, and one camera."""


@dataclass(frozen=True, slots=True)
class PriceSetup:
    """Perception of a robot, with the scale factor of the covariances that its shield receives."""

    name: str
    """Name of the setup in results.json."""
    words: str
    """Description of the setup in tables and figures."""
    group: str
    """Group of the setup in the figure, one of `GROUPS`."""
    perception: PerceptionSetup
    """Level, estimator, cameras and latency."""
    wrong: tuple[Faults, ...] = ((),)
    """Additional camera faults. Successive episodes use the elements in turn."""
    covariance: float = 1.0
    """Factor on the covariances that the shield receives."""

    def turns(self, scene: str) -> tuple[Turn, ...]:
        """Return the cameras and faults that successive episodes use in turn.

        Args:
            scene: name of the scene that contains the cameras.
        """
        turns = self.perception.list_turns(RIGS[scene])
        return tuple(
            Turn(turn.cameras, (*turn.faults, *more)) for turn in turns for more in self.wrong
        )


GROUPS = {
    "truth": "true joints", "estimator": "estimators", "cameras": "fewer cameras",
    "latency": "late images", "calibration": "miscalibrated cameras",
    "covariance": "scaled covariances", "fault": "faults",
}  # fmt: skip
"""Labels of the groups of setups in the figure."""


def _fail_all(
    kind: str, amount: float | None, start_s: float = 0.0, end_s: float = FOREVER_S
) -> tuple[Faults, ...]:
    return ((FaultConfig(kind, (ALL,), amount, start_s, end_s),),)


def _fail_each(kind: str, amount: float | None = None, start_s: float = 0.0) -> tuple[Faults, ...]:
    return tuple((FaultConfig(kind, (camera.name,), amount, start_s),) for camera in RIGS["lab"])


def _make_late(latency_s: float, is_told: bool) -> PriceSetup:
    ms = round(1000 * latency_s)
    stamped = "time-stamped" if is_told else "not time-stamped"
    return PriceSetup(
        f"late_{ms}ms{'' if is_told else '_untold'}",
        f"images {ms} ms late, {stamped}",
        "latency",
        PerceptionSetup(latency_s=latency_s, is_told=is_told),
    )


def list_setups() -> dict[str, PriceSetup]:
    """Return the setups by name, including every registered estimator with four cameras."""
    four, one, degree = PerceptionSetup(), PerceptionSetup(n_cameras=1), math.radians(1.0)
    estimators = (
        PriceSetup(each, f"four cameras, {each}", "estimator", PerceptionSetup(estimator=each))
        for each in ESTIMATORS
    )
    wrong = (
        ("all_turned_1deg", "all cameras turned by 1 degree", _fail_all("wrong_rotation", degree)),
        (
            "all_turned_0_3deg",
            "all turned by 0.3 degrees",
            _fail_all("wrong_rotation", 0.3 * degree),
        ),
        ("all_moved_10cm", "all cameras moved by 10 cm", _fail_all("wrong_translation", 0.1)),
        (
            "one_turned_3deg",
            "one camera turned by 3 degrees",
            _fail_each("wrong_rotation", 3 * degree),
        ),
        ("one_knocked", "one camera knocked over after 2 s", _fail_each("knocked", None, 2.0)),
    )
    faults = (
        ("dropped_60", "60 % of images missing", _fail_all("dropped", 0.6)),
        ("one_frozen", "one camera frozen after 2 s", _fail_each("frozen", None, 2.0)),
        ("blind_3s", "all cameras lost from 3 to 6 s", _fail_all("lost", None, 3.0, 6.0)),
    )  # fmt: skip
    scaled = (
        (f"{name}{key}", f"{words}, covariances times {factor:g}", setup, factor)
        for name, words, setup in (("", "four cameras", four), ("one_camera_", "one camera", one))
        for key, factor in (("half_covariance", 0.5), ("twice_covariance", 2))
    )
    setups = (
        PriceSetup(TRUTH, "true joints", "truth", PerceptionSetup("truth")),
        *estimators,
        PriceSetup("three_cameras", "three cameras", "cameras", PerceptionSetup(n_cameras=3)),
        PriceSetup("two_cameras", "two cameras", "cameras", PerceptionSetup(n_cameras=2)),
        PriceSetup(ONE, "one camera", "cameras", one),
        *(_make_late(s, is_told) for is_told in (True, False) for s in LATE_S),
        *(PriceSetup(name, words, "calibration", four, each) for name, words, each in wrong),
        *(PriceSetup(n, words, "covariance", setup, covariance=k) for n, words, setup, k in scaled),
        *(PriceSetup(name, words, "fault", four, each) for name, words, each in faults),
    )
    return {each.name: each for each in setups}


QUICK = (
    TRUTH, FOUR, "paper_restarts", "triangulation", "three_cameras", "two_cameras", ONE,
    "late_120ms", "late_200ms", "late_200ms_untold", "all_turned_1deg", "half_covariance",
)  # fmt: skip
"""Names of the twelve setups of the quick form and of the figure."""
ELSEWHERE = (TRUTH, FOUR, ONE)
"""Names of the setups that are compared in every other task."""
ON_REQUEST = ("kalman", "paper")
"""Names of setups that are compared only on request: with four cameras, `kalman` equals the
default, and `paper` takes minutes per episode."""


def list_default_setups() -> tuple[str, ...]:
    """Return the names of the setups that are compared by default."""
    return tuple(name for name in list_setups() if name not in ON_REQUEST)


def find_setups(names: Collection[str]) -> list[PriceSetup]:
    """Return the setups with the given names; raise `ConfigError` if a name is unknown."""
    known = list_setups()
    check_names("perception setup", names, known)
    return [known[name] for name in names]
