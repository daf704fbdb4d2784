"""All pictures and the page: every body, every motion, every scene."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import imageio.v2 as imageio

from benchmarks.gallery.motions import strip
from benchmarks.gallery.page import Exhibit, write_page
from benchmarks.gallery.still import CASTS, portrait, views
from hrc_env.core.errors import unknown
from hrc_env.core.typing import Image
from hrc_env.motion.repertoire import REPERTOIRE
from hrc_env.worker.body import load_body, worker_names

Say = Callable[[float, str], None]
"""Told by how much the share that is done grew, and what is being done."""
VIEWS = 5
"""Pictures of a scene."""


@dataclass(frozen=True, slots=True)
class GalleryConfig:
    """What is drawn."""

    bodies: tuple[str, ...] = worker_names()
    """Which workers."""
    motions: tuple[str, ...] = tuple(REPERTOIRE)
    """Which scenes of the repertoire."""
    scenes: tuple[str, ...] = tuple(CASTS)
    """Which places."""

    def __post_init__(self) -> None:
        for name, chosen, known in (
            ("worker", self.bodies, worker_names()),
            ("motion", self.motions, REPERTOIRE),
            ("scene", self.scenes, CASTS),
        ):
            for each in chosen:
                if each not in known:
                    raise unknown(name, each, known)


def run(config: GalleryConfig, out: Path, say: Say) -> list[Exhibit]:
    """Draw everything into a folder, with an `index.html`; returns what the page shows.

    Args:
        config: what is drawn.
        out: the folder, made if it is not there.
        say: hears of the progress.
    """
    out.mkdir(parents=True, exist_ok=True)
    share = 1.0 / max(len(config.bodies) + len(config.motions) + VIEWS * len(config.scenes), 1)
    exhibits = [
        *_places(config, out, lambda name: say(VIEWS * share, name)),
        *_workers(config, out, lambda name: say(share, name)),
        *_motions(config, out, lambda name: say(share, name)),
    ]
    write_page(exhibits, out, "python -m hrc_env gallery")
    return exhibits


def _places(config: GalleryConfig, out: Path, done: Callable[[str], None]) -> list[Exhibit]:
    shown = []
    for k, name in enumerate(config.scenes):
        body = worker_names()[k % len(worker_names())]
        for i, (view, picture) in enumerate(views(name, body).items()):
            seen = "for people" if i == 0 else "what this camera of the rig sees"
            title = f"{name}, {view.replace('_', ' ')}"
            file = _save(picture, out, f"place {name} {view}")
            shown.append(Exhibit("Places", file, title, seen, i == 0))
        done(name)
    return shown


def _workers(config: GalleryConfig, out: Path, done: Callable[[str], None]) -> list[Exhibit]:
    shown = []
    for name in config.bodies:
        file = _save(portrait(name), out, f"body {name}")
        caption = f"{load_body(name).stature_m:.2f} m tall"
        shown.append(Exhibit("Workers", file, name.replace("_", " "), caption, False))
        done(name)
    return shown


def _motions(config: GalleryConfig, out: Path, done: Callable[[str], None]) -> list[Exhibit]:
    """Every worker plays in turn; strips of one worker are drawn one after another."""
    bodies, files = config.bodies or worker_names(), {}
    for k, body in enumerate(bodies):
        for name in config.motions[k :: len(bodies)]:
            files[name] = body, _save(strip(name, body), out, f"motion {name}")
            done(name)
    return [
        Exhibit("Motions", files[name][1], name, f"by {files[name][0].replace('_', ' ')}", True)
        for name in config.motions
    ]


def _save(picture: Image, out: Path, title: str) -> str:
    """Write a PNG; its name."""
    words = "".join(letter if letter.isalnum() else " " for letter in title).split()
    file = "_".join(words) + ".png"
    imageio.imwrite(out / file, picture)
    return file
