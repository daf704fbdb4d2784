"""Cameras that hang, look or zoom otherwise than the tracker is told."""

import math

from hrc_env.experiments.beyond.metrics import Found
from hrc_env.experiments.beyond.study import Curves, Line, Panel, Rows, Study
from hrc_env.experiments.beyond.trial.setting import Setting, Turn
from hrc_env.perception.faults.fault import ALL as EVERY
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.scene.rigs import RIGS

AMOUNTS: dict[str, tuple[float, ...]] = {
    "rotation": (0.1, 0.3, 1.0, 3.0),
    "translation": (1.0, 3.0, 10.0, 20.0),
    "focal": (0.5, 1.0, 2.0, 5.0),
}
UNITS = {"rotation": "deg", "translation": "cm", "focal": "pct"}
SPOKEN = {"rotation": "deg", "translation": "cm", "focal": "%"}
WORDS = {"rotation": "rotation", "translation": "translation", "focal": "focal length"}
_IN_FAULTS = {"rotation": math.radians(1), "translation": 0.01, "focal": 0.01}
AS_TOLD = "as_told"


def _called(which: str, kind: str, amount: float) -> str:
    return f"{which}_{kind}_{f'{amount:g}'.replace('.', '_')}{UNITS[kind]}"


def _wrong(which: str, kind: str, amount: float, scene: str = "lab") -> Setting:
    """One camera in turns, or all of them, off by so much."""
    names = [(camera.name,) for camera in RIGS[scene]] if which == "one" else [(EVERY,)]
    how_much = amount * _IN_FAULTS[kind]
    turns = tuple(Turn(faults=(FaultConfig(f"wrong_{kind}", name, how_much),)) for name in names)
    whose = "one camera" if which == "one" else "all cameras"
    words, name = (
        f"{whose}: {WORDS[kind]} by {amount:g} {SPOKEN[kind]}",
        _called(which, kind, amount),
    )
    if scene == "lab":
        return Setting(name, words, turns=turns)
    return Setting(f"{scene}_{name}", f"{scene}, {words}", scene=scene, turns=turns)


LAB = tuple(
    _wrong(which, kind, amount)
    for kind, amounts in AMOUNTS.items()
    for which in ("one", "all")
    for amount in amounts
)
SITE = (
    Setting("site_as_told", "site, as told", scene="site"),
    *(_wrong(which, "rotation", amount, "site") for which in ("one", "all") for amount in (0.3, 1)),
)


def _panels(found: Found) -> tuple[Panel, ...]:
    del found
    curves = tuple(
        Curves(
            f"Wrong {WORDS[kind]}",
            f"off by [{SPOKEN[kind]}]",
            tuple(
                Line(
                    {"one": "one camera", "all": "all cameras"}[which],
                    tuple((amount, _called(which, kind, amount)) for amount in amounts),
                )
                for which in ("one", "all")
            ),
            is_log=True,
        )
        for kind, amounts in AMOUNTS.items()
    )
    return (*curves, Rows("As told, and on the site", (AS_TOLD, *(each.name for each in SITE))))


def _says(found: Found) -> str:
    bearable = 1.2 * found.error(AS_TOLD).value
    parts = []
    for kind, amounts in AMOUNTS.items():
        borne = [a for a in amounts if found.error(_called("all", kind, a)).value <= bearable]
        most = f"up to {max(borne):g}" if borne else f"less than {amounts[0]:g}"
        parts.append(f"{most} {SPOKEN[kind]} of {WORDS[kind]}")
    one, all_ = _called("one", "rotation", 1.0), _called("all", "rotation", 1.0)
    return (
        f"As told the median error is {found.mm(AS_TOLD)}; it stays within 20 % of that with all "
        f"cameras off by {', '.join(parts)}. One degree costs {found.mm(one)} in one camera and "
        f"{found.mm(all_)} in all (coverage {found.of('coverage95', one).value:.2f} and "
        f"{found.of('coverage95', all_).value:.2f}), on the site "
        f"{found.mm(f'site_{one}')} and {found.mm(f'site_{all_}')} instead of "
        f"{found.mm('site_as_told')}."
    )


CALIBRATION = Study(
    "calibration",
    "How well must cameras be calibrated?",
    "Cameras look, hang or zoom otherwise than the tracker is told, in a direction that is drawn "
    "for every episode (a focal length is always too long); one of the four, in turns, or each of "
    "them by as much.",
    (Setting(AS_TOLD, "as told"), *LAB, *SITE),
    _panels,
    _says,
)
