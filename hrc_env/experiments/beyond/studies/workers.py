"""Several workers before the same cameras."""

from hrc_env.experiments.beyond.metrics import Found
from hrc_env.experiments.beyond.study import Curves, Line, Panel, Study
from hrc_env.experiments.beyond.trial.setting import Setting

NUMBERS = (1, 2, 3)
SCENES = {"lab": "laboratory", "site": "site"}
SETTINGS = tuple(
    Setting(f"{scene}_{n}", f"{words}: {n}", scene=scene, n_workers=n)
    for scene, words in SCENES.items()
    for n in NUMBERS
)


def _panels(found: Found) -> tuple[Panel, ...]:
    del found
    lines = tuple(
        Line(words, tuple((float(n), f"{scene}_{n}") for n in NUMBERS))
        for scene, words in SCENES.items()
    )
    return (Curves("Four cameras", "workers", lines),)


def _says(found: Found) -> str:
    parts = []
    for scene, words in SCENES.items():
        medians = ", ".join(found.mm(f"{scene}_{n}") for n in NUMBERS)
        shares = ", ".join(f"{100 * found.of('lost', f'{scene}_{n}').value:.1f} %" for n in NUMBERS)
        parts.append(
            f"in the {words} the median error is {medians}, the time without a track {shares}"
        )
    return f"With one, two and three workers: {'; '.join(parts)}."


WORKERS = Study(
    "workers",
    "Several workers",
    "Detections carry no names: poses are given to the workers whose predictions they fit. A "
    "worker is compared with the track that fits best, no track with two; who has no track is "
    "compared with what is left, a prior metres away. Four cameras.",
    SETTINGS,
    _panels,
    _says,
)
