"""Recipes of the workers by name. All values are judgements."""

from dataclasses import dataclass, field, replace

from colours import Colours


@dataclass(frozen=True)
class Recipe:
    """One worker: anny's phenotype in [0, 1] and a stature, clothes and hair."""

    stature_m: float
    """Barefoot, without the hat."""
    sex: str
    """Male or female."""
    age: float
    """0.67 is an adult, 1 is old."""
    muscle: float
    weight: float
    """0.5 is average, 1 is very heavy."""
    proportions: float
    """1 is an idealised figure."""
    colours: Colours
    over: str = "vest"
    """Garment over the shirt: vest, bib (bib and brace overalls) or nothing."""
    hat: bool = True
    hair: str = "none"
    """Hair with a shape of its own: short, bun, ponytail; none is painted on the skin only."""
    beard: float = 0.0
    """0 is stubble (women have none), 1 a full beard."""
    collar: bool = True
    """Whether the shirt has a standing collar; else a round neck."""
    creases: float = 0.6
    """How strongly folds of skin and cloth show."""
    ancestry: dict[str, float] = field(default_factory=dict)
    """Shares of african, asian, caucasian in the features; the default is a third each."""

    @property
    def phenotype(self) -> dict[str, float]:
        """Return the arguments of anny but the height."""
        return {
            "gender": float(self.sex == "female"), "age": self.age, "muscle": self.muscle,
            "weight": self.weight, "proportions": self.proportions, **self.ancestry,
        }  # fmt: skip


LIME, ORANGE = (204, 238, 40), (255, 122, 30)


def _colours(**parts: tuple[int, int, int]) -> Colours:
    return replace(Colours(), **parts)


AFRICAN = {"african": 1.0, "asian": 0.0, "caucasian": 0.0}
ASIAN = {"african": 0.0, "asian": 1.0, "caucasian": 0.0}
CAUCASIAN = {"african": 0.0, "asian": 0.0, "caucasian": 1.0}

RECIPES = {
    "worker_1": Recipe(
        1.78, "male", 0.67, 0.60, 0.50, 0.60, Colours(), collar=False, creases=1.0
    ),
    "worker_2": Recipe(
        1.66, "female", 0.62, 0.50, 0.48, 0.85,
        _colours(
            skin=(228, 184, 158), hair=(104, 66, 38), iris=(74, 96, 108), hat=(238, 238, 234),
            vest=ORANGE, trim=LIME, shirt=(58, 64, 76), trousers=(64, 78, 108),
        ),
        hair="ponytail", ancestry=CAUCASIAN,
    ),
    "worker_3": Recipe(
        1.80, "male", 0.74, 0.16, 0.95, 0.35,
        _colours(
            skin=(222, 166, 138), hair=(120, 72, 40), iris=(84, 104, 96), hat=(60, 150, 70),
            vest=ORANGE, trim=(214, 240, 60), shirt=(44, 62, 104), trousers=(60, 56, 54),
        ),
        beard=1.0, ancestry=CAUCASIAN,
    ),
    "worker_4": Recipe(
        1.92, "male", 0.60, 0.50, 0.20, 0.70,
        _colours(
            skin=(112, 74, 52), hair=(26, 22, 20), iris=(56, 38, 26), hat=(36, 96, 180),
            shirt=(196, 198, 196), bib=(44, 66, 112), trousers=(44, 66, 112),
            boots=(70, 58, 48),
        ),
        over="bib", ancestry=AFRICAN,
    ),
    "worker_5": Recipe(
        1.55, "female", 0.70, 0.26, 0.82, 0.70,
        _colours(
            skin=(186, 134, 102), hair=(36, 26, 22), iris=(66, 46, 32),
            shirt=(150, 54, 70), trousers=(50, 52, 58),
        ),
        hat=False, hair="bun", ancestry={"african": 0.2, "asian": 0.6, "caucasian": 0.2},
    ),
    "worker_6": Recipe(
        1.69, "male", 0.77, 0.34, 0.10, 0.45,
        _colours(
            skin=(216, 172, 136), hair=(142, 140, 138), iris=(58, 42, 32),
            shirt=(74, 104, 78), trousers=(104, 92, 72), boots=(84, 62, 46),
        ),
        over="nothing", hat=False, hair="short", ancestry=ASIAN,
    ),
    "worker_7": Recipe(
        1.75, "female", 0.60, 0.66, 0.46, 0.90,
        _colours(
            skin=(92, 60, 44), hair=(24, 20, 19), iris=(48, 32, 24), hat=(206, 44, 40),
            vest=LIME, trim=(180, 186, 190), shirt=(36, 38, 44), trousers=(40, 44, 52),
        ),
        hair="bun", ancestry=AFRICAN,
    ),
    "worker_8": Recipe(
        1.85, "male", 0.64, 0.88, 0.66, 0.65,
        _colours(
            skin=(196, 148, 116), hair=(40, 30, 26), iris=(70, 50, 34),
            shirt=(188, 70, 44), trousers=(56, 58, 62), boots=(150, 106, 62),
        ),
        over="nothing", hat=False, hair="short", beard=0.8,
        ancestry={"african": 0.1, "asian": 0.2, "caucasian": 0.7},
    ),
}  # fmt: skip
"""Named bodies."""
