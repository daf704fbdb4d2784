"""How many cameras, and where; how many may be blocked; how many workers they can tell apart."""

from hrc_env.experiments.ablations.ablation import Ablation, Setting
from hrc_env.experiments.rigs import (
    ALL,
    NEIGHBOURS,
    OPPOSITE,
    SINGLE,
    TRIPLES,
    Rig,
    Turn,
    left_of,
    left_with,
)
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.perception.faults.fault import FaultConfig

X_M, Y_M, UNDER_CEILING_M, BREAST_M = 2.9, 2.6, 2.45, 1.0
"""Cameras hang so far from the laboratory's middle and above its floor [m]."""
BESIDE_M = 0.5
"""Between two that hang beside each other [m]."""
Place = tuple[float, float]
CORNERS: tuple[Place, ...] = ((X_M, Y_M), (-X_M, Y_M), (-X_M, -Y_M), (X_M, -Y_M))
WALLS: tuple[Place, ...] = ((0.0, Y_M), (-X_M, 0.0), (0.0, -Y_M), (X_M, 0.0))
ROUND = tuple(place for pair in zip(CORNERS, WALLS, strict=True) for place in pair)
"""Eight places round the room, corners and middles of walls in turns."""
PAIRS: tuple[Rig, ...] = (NEIGHBOURS[0], OPPOSITE[0], NEIGHBOURS[1], OPPOSITE[1])
"""Two diagonals and two neighbours, so that no number hangs on how two hang."""


def hung(places: tuple[Place, ...], height_m: float = UNDER_CEILING_M) -> tuple[CameraConfig, ...]:
    """Cameras at places, all at one height, which look at the shared space."""
    numbered = enumerate(places, 1)
    return tuple(CameraConfig(f"place_{k}", (x, y, height_m)) for k, (x, y) in numbered)


def spread_over(n_cameras: int) -> tuple[Turn, ...]:
    """So many of the eight places, as evenly round the room as possible, in every way to do that;
    one camera is what is left of four in the corners, or on the walls, after the warm-up."""
    if n_cameras == 1:
        return tuple(left_with(hung(four), kept) for four in (CORNERS, WALLS) for kept in SINGLE)
    n = len(ROUND)
    rigs = (
        tuple(sorted((first + k * n // n_cameras) % n for k in range(n_cameras)))
        for first in range(n)
    )
    return tuple(Turn(hung(tuple(ROUND[c] for c in rig))) for rig in dict.fromkeys(rigs))


def side_by_side() -> tuple[Turn, ...]:
    """Four along one wall, each wall in turns."""
    along = [-1.0, -1 / 3, 1 / 3, 1.0]
    sides = [tuple((X_M * a, y) for a in along) for y in (Y_M, -Y_M)]
    sides += [tuple((x, Y_M * a) for a in along) for x in (X_M, -X_M)]
    return tuple(Turn(hung(places)) for places in sides)


def beside_each_other() -> tuple[Turn, ...]:
    """Two along a wall in a corner, each corner in turns."""
    return tuple(Turn(hung(((x, y), (x - BESIDE_M * (1 if x > 0 else -1), y)))) for x, y in CORNERS)


def _of(rigs: tuple[Rig, ...]) -> tuple[Turn, ...]:
    """Some of the corners."""
    return tuple(Turn(hung(tuple(CORNERS[c] for c in rig))) for rig in rigs)


CAMERAS = Ablation(
    "cameras",
    "How many cameras, and where?",
    "Cameras of 90 degrees in some of eight places round the laboratory (corners, middles of "
    "walls), 2.45 m high unless said otherwise; which ones goes round. One camera is what is left "
    "of four after the warm-up, as are fewer than four masts of the site.",
    (
        *(
            Setting(f"n{n}", f"{n} of eight places round the room", turns=spread_over(n))
            for n in range(1, 9)
        ),
        Setting("corners", "four: in the corners", turns=_of((ALL,))),
        Setting("walls", "four: in the middles of the walls", turns=(Turn(hung(WALLS)),)),
        Setting("low", "four: in the corners, 1 m high", turns=(Turn(hung(CORNERS, BREAST_M)),)),
        Setting("one_side", "four: along one wall", turns=side_by_side()),
        Setting("two_opposite", "two: opposite corners", turns=_of(OPPOSITE)),
        Setting("two_neighbours", "two: neighbouring corners", turns=_of(NEIGHBOURS)),
        Setting("two_beside", f"two: {BESIDE_M:g} m from each other", turns=beside_each_other()),
        *(
            Setting(f"site_{name}", f"site: {words}", "site", turns=left_of("site", rigs))
            for name, words, rigs in (
                ("one", "one mast", SINGLE),
                ("two_opposite", "two opposite masts", OPPOSITE),
                ("two_neighbours", "two neighbouring masts", NEIGHBOURS),
                ("three", "three masts", TRIPLES),
                ("four", "four masts", (ALL,)),
            )
        ),
    ),
    against=("corners", "site_four"),
)

SCENES = {"lab": "laboratory", "site": "site"}
OCCLUSION = Ablation(
    "occlusion",
    "How many cameras may be blocked at once?",
    "Some of the four cameras fail after the warm-up, which ones goes round; or images of all "
    "cameras are missing at random. In the first, true lines of sight say how many cameras see "
    "each joint past furniture, robot, load and the body itself.",
    (
        *(
            Setting(
                f"{scene}_lost_{n}",
                f"{scene}: {('none', 'one', 'two', 'three')[n]} of four lost",
                scene,
                turns=left_of(scene, rigs),
                by_sight=True,
            )
            for scene in SCENES
            for n, rigs in enumerate(((ALL,), TRIPLES, PAIRS, SINGLE))
        ),
        *(
            Setting(
                f"dropped_{pct}pct",
                f"lab: {pct} % of all images missing",
                turns=(Turn(faults=(FaultConfig("dropped", ("all",), pct / 100),)),),
            )
            for pct in (30, 60, 90)
        ),
    ),
    {
        f"{scene}_seen_{n}": f"{scene}: joints that {n} of four cameras see"
        for scene in SCENES
        for n in range(5)
    },
    against=("lab_lost_0", "site_lost_0"),
)

WORKERS = Ablation(
    "workers",
    "Several workers",
    "Detections carry no names: poses are assigned to the workers whose predictions they fit. A "
    "worker is compared with the track that fits best, no track with two. Four cameras.",
    tuple(
        Setting(f"{scene}_{n}", f"{words}: {n}", scene, n)
        for scene, words in SCENES.items()
        for n in (1, 2, 3)
    ),
)
