"""Validation on people, motions and a place that no part was fitted to.

python -m assets.emulator.holdout --out out/trueness

Two parts are fitted to detections of rendered workers: the positions of the joints of a body
(assets/workers/calibrate_joints.py), and the calibration, which comprises offsets, the deviations
reported to the tracker, and all that the emulator draws. Here the calibration is fitted anew to six
bodies, all motions but one of each family, and one scene. Pixels and emulator are then compared on
the rest; the joints of the other bodies have the mean offsets of the six (`bodies.make_unfitted`).
Clips and fit are kept in the folder, so that an interrupted run can continue.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console

from assets.emulator.bodies import compute_spread, make_unfitted
from assets.emulator.clips import FAMILIES, FIT_RIGS, UNSEEN_RIG, UNSEEN_SEEDS, Clip, list_clips
from assets.emulator.fit.fit import fit
from assets.emulator.fit.novelty import poses_of
from assets.emulator.matching import matched
from assets.emulator.run import part_of
from assets.emulator.samples import make_samples
from assets.emulator.shelf import DEPENDS, watch_cached
from assets.emulator.validate import (
    Compared,
    Say,
    accuracy,
    compared,
    in_space,
    ratios_of,
    select_family,
)
from assets.emulator.writing import write_calibration
from hrc_env.config import HRCConfig
from hrc_env.core.progress import progress_bar
from hrc_env.core.results import Metric, write_results
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Table
from hrc_env.experiments.versions import make_key
from hrc_env.perception.emulator import EmulatorConfig
from hrc_env.worker.body import Body, load_body, worker_names

N_HELD = 2
"""Number of held-out bodies: the last ones."""
FITTED_BODIES, HELD_BODIES = worker_names()[:-N_HELD], worker_names()[-N_HELD:]
HELD_MOTIONS = tuple(motions[1] for motions in FAMILIES.values())
FITTED_MOTIONS = tuple(m for motions in FAMILIES.values() for m in motions if m not in HELD_MOTIONS)
FITTED_SCENE, HELD_SCENE = "lab", "site"


ROUNDS = 3
"""Default number of rounds of clips."""
TRUTHS = {"joint": "joints_world", "landmark": "landmarks_world"}
"""Reference of the errors: the joints as BlazePose defines them, or the anatomical landmarks."""


@dataclass(frozen=True, slots=True)
class Sample:
    """Clips by the parts of them that were held out."""

    rounds: int
    """Number of times that each motion is played, for about 30 clips or more."""
    bodies: tuple[str, ...] = FITTED_BODIES
    motions: tuple[str, ...] = FITTED_MOTIONS
    scene: str = FITTED_SCENE

    def clips(self, most: int) -> list[Clip]:
        """Return clips with displaced cameras, of at most `most` rounds."""
        where = (self.bodies, self.motions, (self.scene,))
        return list_clips(min(self.rounds, most), UNSEEN_SEEDS, (UNSEEN_RIG,), *where)


SAMPLES = {
    "nothing": Sample(1),
    "bodies": Sample(1, bodies=HELD_BODIES),
    "motions": Sample(2, motions=HELD_MOTIONS),
    "scene": Sample(1, scene=HELD_SCENE),
    "everything": Sample(4, HELD_BODIES, HELD_MOTIONS, HELD_SCENE),
}
WORDS = {
    "nothing": "nothing",
    "bodies": "two of eight bodies",
    "motions": "a motion of each family",
    "scene": "the site",
    "everything": "all three",
}
"""Descriptions of the samples."""


TABLES = (
    Table(
        "trueness",
        "Trueness on new bodies and motions",
        {name: (words,) for name, words in WORDS.items()},
        (
            Column("{}.joint.median.upright", "upright, median [mm]"),
            Column("{}.joint.p95.upright", "95 % [mm]", 0),
            Column("{}.joint.coverage.upright", "coverage", 3),
            Column("{}.landmark.median.upright", "median to landmarks [mm]"),
            Column("{}.emulator_error_ratio.upright", "median, emulator / pixels", 2),
            Column("{}.emulator_coverage_difference.upright", "coverage, emulator - pixels", 3),
            Column("{}.joint.median.fold", "folded, median [mm]"),
            Column("{}.joint.coverage.fold", "coverage", 3),
        ),
        ("held out",),
        "Errors of joints at `pixels` after the default estimator; 95 % bootstrap intervals over "
        "clips. The fit has six bodies, the laboratory, and all motions but one of each family; "
        "cameras and seeds differ from those of the fit in every row. Folded: bent, squatting or "
        "kneeling bodies, which are rare with the default jobs; upright: all others. To landmarks: "
        "distance to anatomical (COCO) landmarks instead of the points that BlazePose detects.",
    ),
)
"""Tables of the documentation."""


def main(out: Path = Path("out/trueness"), rounds: int = ROUNDS) -> None:
    """Fit to a part, compare on the rest and write results.json.

    Args:
        out: folder of clips, calibration and results.
        rounds: number of times that each motion is played for the fit, and at most for the rest.
    """
    console = Console()
    with progress_bar(console, "trueness") as say:
        config = fit_config(out, rounds, part_of(say, 0.5))
        parts = PartCache(out / "parts", "", len(SAMPLES), part_of(say, 0.5))
        metrics = judged(parts, config, rounds, out)
    settings = {"rounds": rounds, "bodies": HELD_BODIES, "motions": HELD_MOTIONS}
    write_results(out / "results.json", {**settings, "scene": HELD_SCENE}, [0], metrics)
    for key, each in metrics.items():
        console.print(f"{key:55s} {each.value:8.3f} ({each.low:.3f} to {each.high:.3f})")


def judged(
    parts: PartCache, config: HRCConfig, rounds: int, store: Path | None
) -> dict[str, Metric]:
    """Return the metrics of all samples, from the cache or computed anew.

    Args:
        parts: cache of the samples' metrics.
        config: settings with the calibration that is validated.
        rounds: greatest number of times that each motion is played.
        store: folder of rendered clips; None: they are rendered anew.
    """
    metrics = dict[str, Metric]()
    digest = hashlib.sha256(Path(config.emulator.calibration).read_bytes()).hexdigest()
    key = make_key({"calibration": digest, "rounds": rounds}, DEPENDS)
    for name, sample in SAMPLES.items():

        def make(tick: PartProgress, sample: Sample = sample) -> dict[str, Any]:
            clips = sample.clips(rounds)
            seen = compared(clips, lambda share, _: tick(share), config, store, load_joints)
            return {each: asdict(metric) for each, metric in compute_metrics(seen)}

        part = parts.make_part(name, make, key)
        metrics |= {f"{name}.{each}": Metric(**values) for each, values in part.items()}
    return metrics


def find_calibration(out: Path, rounds: int) -> Path:
    """Return the path of the calibration that is fitted to the clips that are not held out."""
    return out / f"keypoints-{make_key({'rounds': rounds}, DEPENDS)}.json"


def load_joints(name: str) -> Body:
    """Return a body; a held-out one without the offsets that were fitted to its detections."""
    return make_unfitted(name, FITTED_BODIES) if name in HELD_BODIES else load_body(name)


def fit_config(out: Path, rounds: int, say: Say) -> HRCConfig:
    """Return settings with a calibration fitted to the clips that are not held out, made if
    necessary."""
    path, config = find_calibration(out, rounds), HRCConfig()
    where = (FITTED_BODIES, FITTED_MOTIONS, (FITTED_SCENE,))
    clips, pixels = list_clips(rounds, 0, FIT_RIGS, *where), []
    for clip, watched in zip(clips, watch_cached("pixels", clips, config, out), strict=True):
        pixels.append(watched)
        say(0.7 / len(clips), f"fit: {clip.motion}")
    if not path.exists():
        draft = fit(make_samples(pixels), poses_of(pixels), compute_spread(FITTED_BODIES))
        made = matched(draft, clips, pixels, path.with_suffix(".fit"), part_of(say, 0.3))
        write_calibration(path, made, {"clips": len(clips), "bodies": FITTED_BODIES})
    return replace(config, emulator=EmulatorConfig(calibration=str(path)))


def compute_metrics(seen: Compared) -> Iterator[tuple[str, Metric]]:
    """Return medians, 95th percentiles [mm] and coverage of pixels by group, for both references,
    and the differences of the emulator from them."""
    for word, truth in TRUTHS.items():
        each = [in_space([watched], truth) for watched in seen.pixels]
        for group in seen.outcomes:
            mine = select_family(seen.clips, group)
            found = accuracy([each[k] for k in mine])
            for what, metric in zip(("median", "p95", "coverage"), found, strict=True):
                yield f"{word}.{what}.{group}", metric
    yield from ratios_of(seen).items()


if __name__ == "__main__":
    tyro.cli(main)
