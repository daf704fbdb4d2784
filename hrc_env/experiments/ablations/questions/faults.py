"""Ablations of delayed images and of miscalibrated cameras."""

import math
from typing import NamedTuple

from hrc_env.experiments.ablations.ablation import Ablation, Setting
from hrc_env.experiments.rigs import Turn, delay
from hrc_env.perception.faults.fault import ALL as EVERY
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.scene.rigs import RIGS

LATE_MS = (40, 80, 120, 200, 320)
"""Latencies of images [ms]. They are multiples of the control step, hence 320 instead of 300."""
LATENCY = Ablation(
    "latency",
    "How late may images be?",
    "All four cameras of the laboratory deliver every image late by the same time. Time-stamped: "
    "an image carries its time, is used at that time, and the filter predicts from there. Not "
    "time-stamped: it appears to be current.",
    (
        Setting("on_time", "on time"),
        *(
            Setting(
                f"{'told' if told else 'untold'}_{ms}ms",
                f"{ms} ms late, {'' if told else 'not '}time-stamped",
                turns=(delay(Turn(RIGS["lab"] if told else ()), ms / 1000, told),),
            )
            for told in (True, False)
            for ms in LATE_MS
        ),
    ),
    against=("on_time",),
)


class Miscalibration(NamedTuple):
    """A kind of calibration error, with the amounts to compare."""

    words: str
    """Description of the error in tables."""
    unit: str
    """Unit of amounts in tables."""
    short: str
    """Unit of amounts in names of settings."""
    scale: float
    """Amount of the fault, in the units of `FaultConfig`, that corresponds to one unit in
    tables."""
    amounts: tuple[float, ...]
    """Amounts to compare, in the unit of tables."""


KINDS = {
    "rotation": Miscalibration("rotation", "deg", "deg", math.radians(1), (0.1, 0.3, 1.0, 3.0)),
    "translation": Miscalibration("translation", "cm", "cm", 0.01, (1.0, 3.0, 10.0, 20.0)),
    "focal": Miscalibration("focal length", "%", "pct", 0.01, (0.5, 1.0, 2.0, 5.0)),
}
"""Kinds of calibration errors by the name of their fault."""
AFFECTED = {"one": "one camera", "all": "all cameras"}
"""Descriptions of the choices of miscalibrated cameras, by name."""


def _miscalibrate(affected: str, name: str, amount: float, scene: str = "lab") -> Setting:
    """Return a setting in which one camera at a time, or all cameras, have a calibration error."""
    kind = KINDS[name]
    names = [(camera.name,) for camera in RIGS[scene]] if affected == "one" else [(EVERY,)]
    faults = [FaultConfig(f"wrong_{name}", cameras, amount * kind.scale) for cameras in names]
    label = f"{affected}_{name}_{f'{amount:g}'.replace('.', '_')}{kind.short}"
    words = f"{AFFECTED[affected]}: {kind.words} by {amount:g} {kind.unit}"
    if scene != "lab":
        label, words = f"{scene}_{label}", f"{scene}, {words}"
    return Setting(label, words, scene, turns=tuple(Turn(faults=(fault,)) for fault in faults))


CALIBRATION = Ablation(
    "calibration",
    "How well must cameras be calibrated?",
    "The true pose or focal length of cameras differs from their calibration, in a direction that "
    "is drawn for every episode (a focal length is always too long): for one of the four, in "
    "turns, or for each of them by the same amount.",
    (
        Setting("as_told", "as calibrated"),
        *(
            _miscalibrate(affected, name, amount)
            for name, kind in KINDS.items()
            for affected in AFFECTED
            for amount in kind.amounts
        ),
        Setting("site_as_told", "site, as calibrated", "site"),
        *(
            _miscalibrate(affected, "rotation", amount, "site")
            for affected in AFFECTED
            for amount in (0.3, 1)
        ),
    ),
    against=("as_told", "site_as_told"),
)
