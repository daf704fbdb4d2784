"""The perception setups of the price study, from true bodies to one camera."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from hrc_env.core.errors import check_names
from hrc_env.experiments.rigs import Turn
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.scene.rigs import RIGS

TRUE_CAPSULES, TRUTH, FOUR, ONE = "true_capsules", "truth", "four_cameras", "one_camera"
"""Names of setups: true bodies, true joints, four cameras, and one camera after the warm-up."""
Family = Literal["exact", "joints", "cameras", "one camera", "late", "late untold"]
"""Kind of perception, which determines the settings of the shield that are compared."""


@dataclass(frozen=True, slots=True)
class PriceSetup:
    """The perception of a robot in the price study."""

    name: str
    """Name of the setup in results.json."""
    words: str
    """Description of the setup in tables and figures."""
    family: Family
    """Kind of perception."""
    perception: PerceptionSetup
    """Level, estimator, cameras and latency."""

    @property
    def knows_bodies(self) -> bool:
        """Whether the shield receives the true capsules of the workers (`TrueBodyShield`)."""
        return self.family == "exact"

    def turns(self, scene: str) -> tuple[Turn, ...]:
        """Return the cameras and faults that successive episodes use in turn.

        Args:
            scene: name of the scene that contains the cameras.
        """
        return self.perception.list_turns(RIGS[scene])


_SETUPS = (
    PriceSetup(TRUE_CAPSULES, "true capsules", "exact", PerceptionSetup("truth")),
    PriceSetup(TRUTH, "true joints", "joints", PerceptionSetup("truth")),
    PriceSetup(FOUR, "four cameras", "cameras", PerceptionSetup()),
    PriceSetup("two_cameras", "two cameras", "cameras", PerceptionSetup(n_cameras=2)),
    PriceSetup(ONE, "one camera after 1 s", "one camera", PerceptionSetup(n_cameras=1)),
    PriceSetup(
        "one_alone", "one camera from the start", "one camera",
        PerceptionSetup(n_cameras=1, is_alone=True),
    ),
    PriceSetup(
        "late_200ms", "200 ms late, time-stamped", "late", PerceptionSetup(latency_s=0.2),
    ),
    PriceSetup(
        "late_120ms_untold", "120 ms late, not time-stamped", "late untold",
        PerceptionSetup(latency_s=0.12, is_told=False),
    ),
)  # fmt: skip
QUICK = (TRUE_CAPSULES, TRUTH, FOUR, ONE)
"""Names of the setups of the quick form."""


def list_setups() -> dict[str, PriceSetup]:
    """Return the setups by name."""
    return {each.name: each for each in _SETUPS}


def list_default_setups() -> tuple[str, ...]:
    """Return the names of the setups that are compared by default."""
    return tuple(list_setups())


def find_setups(names: Collection[str]) -> list[PriceSetup]:
    """Return the setups with the given names; raise `ConfigError` if a name is unknown."""
    known = list_setups()
    check_names("perception setup", names, known)
    return [known[name] for name in names]
