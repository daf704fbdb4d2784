"""Images that come late, and cameras that hang, look or zoom otherwise than the tracker is told."""

import math

from hrc_env.experiments.ablations.ablation import Ablation, Setting
from hrc_env.experiments.rigs import Turn, late
from hrc_env.perception.faults.fault import ALL as EVERY
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.scene.rigs import RIGS

LATE_MS = (40, 80, 120, 200, 320)
"""Multiples of the control step, at which images come: 300 ms would be 320 [ms]."""
LATENCY = Ablation(
    "latency",
    "How late may images be?",
    "All four cameras of the laboratory give every image so much later. Told: an image says when "
    "it was taken, is used at that time, and the filter predicts from there. Not told: it claims "
    "to be new.",
    (
        Setting("on_time", "on time"),
        *(
            Setting(
                f"{'told' if told else 'untold'}_{ms}ms",
                f"{ms} ms late, {'told' if told else 'not told'}",
                turns=(late(Turn(RIGS["lab"] if told else ()), ms / 1000, told),),
            )
            for told in (True, False)
            for ms in LATE_MS
        ),
    ),
    against=("on_time",),
)

KINDS = {
    "rotation": ("rotation", "deg", "deg", math.radians(1), (0.1, 0.3, 1.0, 3.0)),
    "translation": ("translation", "cm", "cm", 0.01, (1.0, 3.0, 10.0, 20.0)),
    "focal": ("focal length", "%", "pct", 0.01, (0.5, 1.0, 2.0, 5.0)),
}
"""By kind of fault: words, unit, unit in names, a unit in the fault's amount, amounts."""
WHOSE = {"one": "one camera", "all": "all cameras"}


def _wrong(which: str, kind: str, amount: float, scene: str = "lab") -> Setting:
    """One camera in turns, or all of them, off by so much."""
    words, unit, short, scale, _ = KINDS[kind]
    names = [(camera.name,) for camera in RIGS[scene]] if which == "one" else [(EVERY,)]
    faults = [FaultConfig(f"wrong_{kind}", each, amount * scale) for each in names]
    name = f"{which}_{kind}_{f'{amount:g}'.replace('.', '_')}{short}"
    words = f"{WHOSE[which]}: {words} by {amount:g} {unit}"
    if scene != "lab":
        name, words = f"{scene}_{name}", f"{scene}, {words}"
    return Setting(name, words, scene, turns=tuple(Turn(faults=(fault,)) for fault in faults))


CALIBRATION = Ablation(
    "calibration",
    "How well must cameras be calibrated?",
    "Cameras look, hang or zoom otherwise than the tracker is told, in a direction that is drawn "
    "for every episode (a focal length is always too long); one of the four, in turns, or each of "
    "them by as much.",
    (
        Setting("as_told", "as told"),
        *(
            _wrong(which, kind, amount)
            for kind, (*_, amounts) in KINDS.items()
            for which in WHOSE
            for amount in amounts
        ),
        Setting("site_as_told", "site, as told", "site"),
        *(_wrong(which, "rotation", amount, "site") for which in WHOSE for amount in (0.3, 1)),
    ),
    against=("as_told", "site_as_told"),
)
