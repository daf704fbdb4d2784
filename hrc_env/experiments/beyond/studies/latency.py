"""Images that come late, with and without saying so."""

from dataclasses import replace

from hrc_env.experiments.beyond.metrics import Found
from hrc_env.experiments.beyond.study import Curves, Panel, Study, across
from hrc_env.experiments.beyond.trial.play import DT_S
from hrc_env.experiments.beyond.trial.setting import Setting, Turn
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.scene.rigs import RIGS

LATE_MS = (40, 80, 120, 200, 320)
"""Multiples of the control step, at which images come: 300 ms would be 320 [ms]."""
ON_TIME = "on_time"


def _told(ms: int) -> Setting:
    rig = tuple(replace(camera, latency_s=ms / 1000) for camera in RIGS["lab"])
    return Setting(f"told_{ms}ms", f"{ms} ms late, told", turns=(Turn(rig),))


def _untold(ms: int) -> Setting:
    fault = FaultConfig("out_of_step", ("all",), float(round(ms / 1000 / DT_S)))
    return Setting(f"untold_{ms}ms", f"{ms} ms late, not told", turns=(Turn(faults=(fault,)),))


def _panels(found: Found) -> tuple[Panel, ...]:
    del found
    lines = tuple(
        across(label, {0.0: ON_TIME} | {float(ms): f"{how}_{ms}ms" for ms in LATE_MS})
        for how, label in (("told", "told"), ("untold", "not told"))
    )
    return (Curves("All four cameras late", "lateness [ms]", lines),)


def _says(found: Found) -> str:
    parts = [
        f"{ms} ms cost {found.mm(f'told_{ms}ms')} told and {found.mm(f'untold_{ms}ms')} not told "
        f"(coverage {found.of('coverage95', f'told_{ms}ms').value:.2f} and "
        f"{found.of('coverage95', f'untold_{ms}ms').value:.2f})"
        for ms in (120, 320)
    ]
    return (
        f"On time the median error is {found.mm(ON_TIME)}, coverage "
        f"{found.of('coverage95', ON_TIME).value:.2f}; {'; '.join(parts)}."
    )


LATENCY = Study(
    "latency",
    "How late may images be?",
    "All four cameras of the laboratory give every image so much later. Told: an image says when "
    "it was taken, is used at that time, and the filter predicts from there. Not told: it claims "
    "to be new.",
    (Setting(ON_TIME, "on time"), *map(_told, LATE_MS), *map(_untold, LATE_MS)),
    _panels,
    _says,
)
