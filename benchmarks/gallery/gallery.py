"""All pictures and the page: every body, every motion, every scene."""

from dataclasses import dataclass
from pathlib import Path

import imageio.v2 as imageio

from benchmarks.gallery.motions import strip
from benchmarks.gallery.page import Exhibit, write_page
from benchmarks.gallery.still import CASTS, portrait, views
from hrc_env.core.errors import unknown
from hrc_env.core.typing import Image
from hrc_env.experiments.study.cache import Progress
from hrc_env.motion.repertoire import REPERTOIRE
from hrc_env.worker.body import load_body, worker_names

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


def run(config: GalleryConfig, out: Path, say: Progress) -> list[Exhibit]:
    """Draw everything into a folder, with an `index.html`; returns what the page shows.

    Args:
        config: what is drawn.
        out: the folder, made if it is not there.
        say: hears of the progress.
    """
    out.mkdir(parents=True, exist_ok=True)
    share = 1.0 / max(len(config.bodies) + len(config.motions) + VIEWS * len(config.scenes), 1)
    shown: list[Exhibit] = []

    def hang(picture: Image, section: str, title: str, caption: str, wide: bool) -> None:
        words = "".join(x if x.isalnum() else " " for x in f"{section} {title}").split()
        file = "_".join(words).lower() + ".png"
        imageio.imwrite(out / file, picture)
        shown.append(Exhibit(section, file, title, caption, wide))
        say(share, title)

    for k, name in enumerate(config.scenes):
        body = worker_names()[k % len(worker_names())]
        for i, (view, picture) in enumerate(views(name, body).items()):
            seen = "for people" if i == 0 else "what this camera of the rig sees"
            hang(picture, "Places", f"{name}, {view.replace('_', ' ')}", seen, i == 0)
    for name in config.bodies:
        caption = f"{load_body(name).stature_m:.2f} m tall"
        hang(portrait(name), "Workers", name.replace("_", " "), caption, False)
    bodies = config.bodies or worker_names()
    for k, body in enumerate(bodies):  # strips of one worker are drawn one after another
        for name in config.motions[k :: len(bodies)]:
            hang(strip(name, body), "Motions", name, f"by {body.replace('_', ' ')}", True)
    write_page(shown, out, "python -m hrc_env gallery")
    return shown
