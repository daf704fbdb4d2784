"""Cameras that are lost, images that do not come, joints that few cameras see."""

from hrc_env.experiments.beyond.metrics import SEEN, Found
from hrc_env.experiments.beyond.study import Curves, Line, Panel, Rows, Study
from hrc_env.experiments.beyond.trial.setting import (
    ALL,
    PAIRS,
    SINGLE,
    TRIPLES,
    Setting,
    Turn,
    left_of,
)
from hrc_env.perception.faults.fault import FaultConfig

SCENES = ("lab", "site")
LEFT = {0: (ALL,), 1: TRIPLES, 2: PAIRS, 3: SINGLE}
"""Cameras that are left when so many are lost."""
IN_WORDS = ("none", "one", "two", "three")
DROPPED_PCT = (30, 60, 90)

LOST = tuple(
    Setting(
        f"{scene}_lost_{n}",
        f"{scene}: {IN_WORDS[n]} of four lost",
        scene=scene,
        turns=left_of(scene, rigs),
        by_sight=True,
    )
    for scene in SCENES
    for n, rigs in LEFT.items()
)
DROPPED = tuple(
    Setting(
        f"dropped_{pct}pct",
        f"lab: {pct} % of all images missing",
        turns=(Turn(faults=(FaultConfig("dropped", ("all",), pct / 100),)),),
    )
    for pct in DROPPED_PCT
)


def seen_by(scene: str, n_cameras: int) -> str:
    """What joints are called that so many cameras see."""
    return f"{scene}_{SEEN}_{n_cameras}"


def _panels(found: Found) -> tuple[Panel, ...]:
    by_sight = tuple(
        Line(
            {"lab": "laboratory", "site": "site"}[scene],
            tuple(
                (float(n), seen_by(scene, n))
                for n in range(5)
                if found.has("rmse_m", seen_by(scene, n))
            ),
        )
        for scene in SCENES
    )
    return (
        Rows("What is lost", tuple(setting.name for setting in (*LOST, *DROPPED))),
        Curves("Who sees the joint, by truth", "cameras that see it", by_sight),
    )


def _says(found: Found) -> str:
    lost = ", ".join(found.mm(f"lab_lost_{n}", "p95") for n in LEFT)
    known = [n for n in range(5) if found.has("rmse_m", seen_by("lab", n))]
    seen = ", ".join(f"{found.mm(seen_by('lab', n))} ({n})" for n in known)
    nine = f"dropped_{DROPPED_PCT[-1]}pct"
    return (
        f"With none, one, two and three of four cameras lost the 95th percentile of the error is "
        f"{lost}. A joint's median error by the number of cameras that see it at that moment: "
        f"{seen}. With {DROPPED_PCT[-1]} % of all images missing the median is {found.mm(nine)} "
        f"instead of {found.mm('lab_lost_0')}."
    )


OCCLUSION = Study(
    "occlusion",
    "How many cameras may be blocked at once?",
    "Some of the four cameras fail after the warm-up, which ones goes round; or images of all "
    "cameras are missing at random. In all episodes of the first kind the true lines of sight say "
    "how many cameras see each joint: furniture, the robot, what is carried and the body itself "
    "stand in the way.",
    (*LOST, *DROPPED),
    _panels,
    _says,
    {
        seen_by(scene, n): f"{scene}: joints that {n} of four cameras see"
        for scene in SCENES
        for n in range(5)
    },
)
