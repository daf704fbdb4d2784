"""Images that come late, and cameras that hang, look or zoom otherwise than the tracker is told."""

import math

from hrc_env.experiments.ablations.ablation import Ablation, Curves, Rows, Setting
from hrc_env.experiments.study.rigs import Turn, late
from hrc_env.perception.faults.fault import ALL as EVERY
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.scene.rigs import RIGS

LATE_MS = (40, 80, 120, 200, 320)
"""Multiples of the control step, at which images come: 300 ms would be 320 [ms]."""
ON_TIME = Setting("on_time", "on time")
HOW = {"told": "told", "untold": "not told"}
LATENCY = Ablation(
    "latency",
    "How late may images be?",
    "All four cameras of the laboratory give every image so much later. Told: an image says when "
    "it was taken, is used at that time, and the filter predicts from there. Not told: it claims "
    "to be new.",
    (
        ON_TIME,
        *(
            Setting(
                f"{how}_{ms}ms", f"{ms} ms late, {words}",
                turns=(late(Turn(RIGS["lab"] if how == "told" else ()), ms / 1000, how == "told"),),
            )
            for how, words in HOW.items()
            for ms in LATE_MS
        ),
    ),
    (
        Curves("All four cameras late", "lateness [ms]", {
            words: {0.0: ON_TIME.name} | {float(ms): f"{how}_{ms}ms" for ms in LATE_MS}
            for how, words in HOW.items()
        }),
    ),
)  # fmt: skip

KINDS = {
    "rotation": ("rotation", "deg", "deg", math.radians(1), (0.1, 0.3, 1.0, 3.0)),
    "translation": ("translation", "cm", "cm", 0.01, (1.0, 3.0, 10.0, 20.0)),
    "focal": ("focal length", "%", "pct", 0.01, (0.5, 1.0, 2.0, 5.0)),
}
"""By kind of fault: words, unit, unit in names, a unit in the fault's amount, amounts."""
WHOSE = {"one": "one camera", "all": "all cameras"}


def _called(which: str, kind: str, amount: float) -> str:
    return f"{which}_{kind}_{f'{amount:g}'.replace('.', '_')}{KINDS[kind][2]}"


def _wrong(which: str, kind: str, amount: float, scene: str = "lab") -> Setting:
    """One camera in turns, or all of them, off by so much."""
    words, unit, _, scale, _ = KINDS[kind]
    names = [(camera.name,) for camera in RIGS[scene]] if which == "one" else [(EVERY,)]
    faults = [FaultConfig(f"wrong_{kind}", each, amount * scale) for each in names]
    name, words = _called(which, kind, amount), f"{WHOSE[which]}: {words} by {amount:g} {unit}"
    if scene != "lab":
        name, words = f"{scene}_{name}", f"{scene}, {words}"
    return Setting(name, words, scene, turns=tuple(Turn(faults=(fault,)) for fault in faults))


AS_TOLD = Setting("as_told", "as told")
SITE = (
    Setting("site_as_told", "site, as told", "site"),
    *(_wrong(which, "rotation", amount, "site") for which in WHOSE for amount in (0.3, 1)),
)
CALIBRATION = Ablation(
    "calibration",
    "How well must cameras be calibrated?",
    "Cameras look, hang or zoom otherwise than the tracker is told, in a direction that is drawn "
    "for every episode (a focal length is always too long); one of the four, in turns, or each of "
    "them by as much.",
    (
        AS_TOLD,
        *(
            _wrong(which, kind, amount)
            for kind, (*_, amounts) in KINDS.items()
            for which in WHOSE
            for amount in amounts
        ),
        *SITE,
    ),
    (
        *(
            Curves(f"Wrong {words}", f"off by [{unit}]", {
                whose: {amount: _called(which, kind, amount) for amount in amounts}
                for which, whose in WHOSE.items()
            }, is_log=True)
            for kind, (words, unit, _, _, amounts) in KINDS.items()
        ),
        Rows("As told, and on the site", (AS_TOLD, *SITE)),
    ),
)  # fmt: skip
