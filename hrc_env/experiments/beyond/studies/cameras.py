"""How many cameras, and where."""

from hrc_env.experiments.beyond.metrics import Found
from hrc_env.experiments.beyond.study import Curves, Line, Panel, Rows, Study
from hrc_env.experiments.beyond.trial.setting import (
    ALL,
    NEIGHBOURS,
    OPPOSITE,
    SINGLE,
    TRIPLES,
    Rig,
    Setting,
    Turn,
    left_of,
    left_with,
)
from hrc_env.geometry.camera_config import CameraConfig

X_M, Y_M, UNDER_CEILING_M, BREAST_M = 2.9, 2.6, 2.45, 1.0
"""Cameras hang so far from the laboratory's middle and above its floor [m]."""
BESIDE_M = 0.5
"""Between two that hang beside each other [m]."""
Place = tuple[float, float]
CORNERS: tuple[Place, ...] = ((X_M, Y_M), (-X_M, Y_M), (-X_M, -Y_M), (X_M, -Y_M))
WALLS: tuple[Place, ...] = ((0.0, Y_M), (-X_M, 0.0), (0.0, -Y_M), (X_M, 0.0))
ROUND = tuple(place for pair in zip(CORNERS, WALLS, strict=True) for place in pair)
"""Eight places round the room, corners and middles of walls in turns."""


def hung(places: tuple[Place, ...], height_m: float = UNDER_CEILING_M) -> tuple[CameraConfig, ...]:
    """Cameras at places, all at one height, which look at the shared space."""
    return tuple(
        CameraConfig(f"place_{k + 1}", (x, y, height_m)) for k, (x, y) in enumerate(places)
    )


def spread_over(n_cameras: int) -> tuple[Turn, ...]:
    """So many of the eight places, as evenly round the room as possible, in every way to do that.

    One camera is what is left of four after the warm-up: of the corners, or of the walls.
    """
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


NUMBERS = tuple(
    Setting(f"n{n}", f"{n} of eight places round the room", turns=spread_over(n))
    for n in range(1, 9)
)
FOUR = (
    Setting("corners", "four: in the corners", turns=_of((ALL,))),
    Setting("walls", "four: in the middles of the walls", turns=(Turn(hung(WALLS)),)),
    Setting("low", "four: in the corners, 1 m high", turns=(Turn(hung(CORNERS, BREAST_M)),)),
    Setting("one_side", "four: along one wall", turns=side_by_side()),
)
TWO = (
    Setting("two_opposite", "two: opposite corners", turns=_of(OPPOSITE)),
    Setting("two_neighbours", "two: neighbouring corners", turns=_of(NEIGHBOURS)),
    Setting("two_beside", f"two: {BESIDE_M:g} m from each other", turns=beside_each_other()),
)
SITE = tuple(
    Setting(name, words, scene="site", turns=left_of("site", rigs))
    for name, words, rigs in (
        ("site_one", "site: one mast", SINGLE),
        ("site_two_opposite", "site: two opposite masts", OPPOSITE),
        ("site_two_neighbours", "site: two neighbouring masts", NEIGHBOURS),
        ("site_three", "site: three masts", TRIPLES),
        ("site_four", "site: four masts", (ALL,)),
    )
)


def _panels(found: Found) -> tuple[Panel, ...]:
    del found
    by_number = Line("evenly round the laboratory", tuple(
        (float(k + 1), setting.name) for k, setting in enumerate(NUMBERS)
    ))  # fmt: skip
    return (
        Curves("How many", "cameras", (by_number,)),
        Rows("Where", tuple(setting.name for setting in (*FOUR, *TWO, *SITE))),
    )


def _says(found: Found) -> str:
    words = {setting.name: setting.words for setting in (*FOUR, *TWO)}
    names = [setting.name for setting in NUMBERS]
    eight = found.error("n8").value
    enough = next(k + 1 for k, n in enumerate(names) if found.error(n).value <= 1.1 * eight)
    four = [setting.name for setting in FOUR]
    best, worst = found.least(four, "p95"), found.most(four, "p95")
    return (
        f"The median error is {found.mm('n1')} with one camera, {found.mm('n2')} with two, "
        f"{found.mm('n4')} with four and {found.mm('n8')} with eight (95th percentiles "
        f"{found.mm('n1', 'p95')}, {found.mm('n2', 'p95')}, {found.mm('n4', 'p95')}, "
        f"{found.mm('n8', 'p95')}); from {enough} on it is within 10 % of eight's. Of four cameras "
        f"those {words[best].split(': ')[1]} have the least 95th percentile "
        f"({found.mm(best, 'p95')}), those {words[worst].split(': ')[1]} the greatest "
        f"({found.mm(worst, 'p95')}). Two have {found.mm('two_opposite', 'p95')} in opposite "
        f"corners, {found.mm('two_neighbours', 'p95')} in neighbouring ones and "
        f"{found.mm('two_beside', 'p95')} beside each other."
    )


CAMERAS = Study(
    "cameras",
    "How many cameras, and where?",
    "Cameras of 90 degrees in some of eight places round the laboratory (four corners, four "
    "middles of walls), 2.45 m high unless said otherwise; which ones goes round. One camera is "
    "what is left of four after the warm-up. Then four and two in other places; and the four "
    "masts of the site, of which some fail after the warm-up.",
    (*NUMBERS, *FOUR, *TWO, *SITE),
    _panels,
    _says,
)
