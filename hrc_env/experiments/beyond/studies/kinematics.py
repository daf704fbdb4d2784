"""What it is worth to know the body: its bones, and that joints belong together."""

from hrc_env.experiments.beyond.metrics import Found
from hrc_env.experiments.beyond.study import Panel, Rows, Study
from hrc_env.experiments.beyond.trial.setting import ALL, PAIRS, SINGLE, Rig, Setting, left_of

CAMERAS: dict[str, tuple[str, tuple[Rig, ...]]] = {
    "4cam": ("four cameras", (ALL,)),
    "2cam": ("two cameras", PAIRS),
    "1cam": ("one camera", SINGLE),
}
KNOWING = {
    "known": ("bone lengths known", "particle", "known"),
    "learnt": ("bone lengths learnt (the default)", "particle", "learnt"),
    "none": ("bones of any length", "particle", "none"),
    "points": ("points without a body (ransac)", "ransac", "learnt"),
}
"""What is known of the body: words, estimator and bones."""

SETTINGS = tuple(
    Setting(
        f"{cameras}_{name}",
        f"{spoken}: {words}",
        estimator=estimator,
        bones=bones,
        turns=left_of("lab", rigs),
    )
    for cameras, (spoken, rigs) in CAMERAS.items()
    for name, (words, estimator, bones) in KNOWING.items()
)


def _panels(found: Found) -> tuple[Panel, ...]:
    del found
    return tuple(
        Rows(spoken.capitalize(), tuple(f"{cameras}_{name}" for name in KNOWING))
        for cameras, (spoken, _) in CAMERAS.items()
    )


def _says(found: Found) -> str:
    parts = []
    for cameras, (spoken, _) in CAMERAS.items():
        known, learnt, none, points = (
            f"{1000 * found.of('rmse_m', f'{cameras}_{name}').value:,.0f} mm "
            f"({100 * found.of('coverage95', f'{cameras}_{name}').value:.0f} %)"
            for name in ("known", "learnt", "none", "points")
        )
        parts.append(
            f"{spoken}: {known} where bones are known, {learnt} where they are learnt, {none} of "
            f"any length, {points} for points without a body"
        )
    return f"RMSE (coverage) with {'; '.join(parts)}."


KINEMATICS = Study(
    "kinematics",
    "What it is worth to know the body",
    "The default filter with the worker's true bone lengths, with lengths that it learns, and "
    "with none expected (its joints are then held together by the motion model alone); beside "
    "estimators that know less. Bodies are drawn among all that there are. All four cameras of "
    "the laboratory, two or one of them left after the warm-up.",
    SETTINGS,
    _panels,
    _says,
)
