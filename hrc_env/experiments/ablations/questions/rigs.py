"""Ablations of the number and positions of cameras, of occlusion, and of several workers."""

from hrc_env.experiments.ablations.ablation import Ablation, Setting
from hrc_env.experiments.rigs import (
    ALL,
    NEIGHBOURS,
    OPPOSITE,
    SINGLE,
    TRIPLES,
    Rig,
    Turn,
    keep_cameras,
    make_turns,
)
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.perception.faults.fault import FaultConfig

X_M, Y_M = 2.9, 2.6
"""Distances of cameras from the centre of the laboratory along x and y [m]."""
UNDER_CEILING_M, BREAST_M = 2.45, 1.0
"""Heights of cameras above the floor [m]."""
BESIDE_M = 0.5
"""Distance between two cameras that are next to each other [m]."""
Place = tuple[float, float]
"""Horizontal position (x, y) of a camera [m]."""
CORNERS: tuple[Place, ...] = ((X_M, Y_M), (-X_M, Y_M), (-X_M, -Y_M), (X_M, -Y_M))
WALLS: tuple[Place, ...] = ((0.0, Y_M), (-X_M, 0.0), (0.0, -Y_M), (X_M, 0.0))
ROUND = tuple(place for pair in zip(CORNERS, WALLS, strict=True) for place in pair)
"""Eight positions around the room, alternating between corners and centres of walls."""
PAIRS: tuple[Rig, ...] = (NEIGHBOURS[0], OPPOSITE[0], NEIGHBOURS[1], OPPOSITE[1])
"""Pairs of cameras: two pairs of opposite and two of neighbouring ones. Results therefore do not
depend on one arrangement."""


def make_cameras(
    places: tuple[Place, ...], height_m: float = UNDER_CEILING_M
) -> tuple[CameraConfig, ...]:
    """Return cameras at the given positions and height, aimed at the shared workspace."""
    numbered = enumerate(places, 1)
    return tuple(CameraConfig(f"place_{k}", (x, y, height_m)) for k, (x, y) in numbered)


def spread_cameras(n_cameras: int) -> tuple[Turn, ...]:
    """Return all rigs of `n_cameras` at the eight positions, spread as evenly as possible.

    A single camera is one of four in the corners or on the walls; the other three fail after the
    warm-up.
    """
    if n_cameras == 1:
        return tuple(
            keep_cameras(make_cameras(four), kept) for four in (CORNERS, WALLS) for kept in SINGLE
        )
    n = len(ROUND)
    rigs = (
        tuple(sorted((first + k * n // n_cameras) % n for k in range(n_cameras)))
        for first in range(n)
    )
    return tuple(Turn(make_cameras(tuple(ROUND[c] for c in rig))) for rig in dict.fromkeys(rigs))


def place_along_walls() -> tuple[Turn, ...]:
    """Return rigs of four cameras along one wall, one rig for each wall."""
    along = [-1.0, -1 / 3, 1 / 3, 1.0]
    sides = [tuple((X_M * a, y) for a in along) for y in (Y_M, -Y_M)]
    sides += [tuple((x, Y_M * a) for a in along) for x in (X_M, -X_M)]
    return tuple(Turn(make_cameras(places)) for places in sides)


def place_side_by_side() -> tuple[Turn, ...]:
    """Return rigs of two adjacent cameras along a wall, one rig for each corner of the room."""
    pairs = (((x, y), (x - BESIDE_M * (1 if x > 0 else -1), y)) for x, y in CORNERS)
    return tuple(Turn(make_cameras(pair)) for pair in pairs)


def _select_corners(rigs: tuple[Rig, ...]) -> tuple[Turn, ...]:
    """Return a turn for each rig, in which the cameras in the given corners work."""
    return tuple(Turn(make_cameras(tuple(CORNERS[c] for c in rig))) for rig in rigs)


CAMERAS = Ablation(
    "cameras",
    "How many cameras, and where?",
    "Cameras of 90 degrees at some of eight positions around the laboratory (corners, middles of "
    "walls), 2.45 m high unless stated otherwise; episodes rotate over the choices. One camera is "
    "one that remains of four after the warm-up; the same applies to fewer than four masts of the "
    "site.",
    (
        *(
            Setting(f"n{n}", f"{n} of eight places around the room", turns=spread_cameras(n))
            for n in range(1, 9)
        ),
        Setting("corners", "four: in the corners", turns=_select_corners((ALL,))),
        Setting("walls", "four: in the middles of walls", turns=(Turn(make_cameras(WALLS)),)),
        Setting(
            "low", "four: in the corners, 1 m high", turns=(Turn(make_cameras(CORNERS, BREAST_M)),)
        ),
        Setting("one_side", "four: along one wall", turns=place_along_walls()),
        Setting("two_opposite", "two: opposite corners", turns=_select_corners(OPPOSITE)),
        Setting("two_neighbours", "two: neighbouring corners", turns=_select_corners(NEIGHBOURS)),
        Setting("two_beside", f"two: {BESIDE_M:g} m apart", turns=place_side_by_side()),
        *(
            Setting(f"site_{name}", f"site: {words}", "site", turns=make_turns("site", rigs))
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
"""Scenes with their descriptions."""
OCCLUSION = Ablation(
    "occlusion",
    "How many cameras may be blocked at once?",
    "Some of the four cameras fail after the warm-up, over all choices in turns; or images of all "
    "cameras are missing at random. For the first, true lines of sight give the number of cameras "
    "that see each joint past furniture, robot, load and the body itself.",
    (
        *(
            Setting(
                f"{scene}_lost_{n}",
                f"{scene}: {('none', 'one', 'two', 'three')[n]} of four lost",
                scene,
                turns=make_turns(scene, rigs),
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
    "Detections are not labelled by worker: poses are assigned to the workers whose predictions "
    "they fit. A worker is evaluated with the track that fits best, each track with one worker at "
    "most. Four cameras.",
    tuple(
        Setting(f"{scene}_{n}", f"{words}: {n}", scene, n)
        for scene, words in SCENES.items()
        for n in (1, 2, 3)
    ),
)
