"""Creation of the images and the page of the gallery."""

import html
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import imageio.v2 as imageio

from benchmarks.gallery.motions import draw_strip
from benchmarks.gallery.still import CASTS, portrait, views
from hrc_env.core.errors import check_names
from hrc_env.core.typing import Image
from hrc_env.experiments.cache import Progress
from hrc_env.motion.repertoire import SCENES
from hrc_env.worker.body import load_body, worker_names

VIEWS = 5
"""Number of images of each scene."""


STYLE = """
body { max-width: 1240px; margin: 40px auto; padding: 24px; font: 16px/1.5 system-ui, sans-serif; }
.grid { display: grid; grid-template-columns: repeat(auto-fill, minmax(240px, 1fr)); gap: 18px; }
figure { margin: 0; } .wide { grid-column: 1 / -1; } img { width: 100%; }
"""


class Exhibit(NamedTuple):
    """An image in the gallery, with its title and caption."""

    section: str
    file: str
    """Path of the PNG file, relative to the page."""
    title: str
    caption: str
    is_wide: bool
    """Whether the image fills a row of the page."""


@dataclass(frozen=True, slots=True)
class GalleryConfig:
    """Names of the bodies, motions and scenes in the gallery."""

    bodies: tuple[str, ...] = worker_names()
    motions: tuple[str, ...] = tuple(SCENES)
    scenes: tuple[str, ...] = tuple(CASTS)

    def __post_init__(self) -> None:
        check_names("worker", self.bodies, worker_names())
        check_names("motion", self.motions, SCENES)
        check_names("scene", self.scenes, CASTS)


def run(config: GalleryConfig, out: Path, say: Progress) -> list[Exhibit]:
    """Render all images into a folder, write its `index.html`, and return the exhibits."""
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
            seen = "for people" if i == 0 else "view of this camera of the rig"
            hang(picture, "Places", f"{name}, {view.replace('_', ' ')}", seen, i == 0)
    for name in config.bodies:
        caption = f"{load_body(name).stature_m:.2f} m tall"
        hang(portrait(name), "Workers", name.replace("_", " "), caption, False)
    bodies = config.bodies or worker_names()
    for k, body in enumerate(bodies):  # consecutive strips share a worker
        for name in config.motions[k :: len(bodies)]:
            hang(draw_strip(name, body), "Motions", name, f"by {body.replace('_', ' ')}", True)
    write_page(shown, out, "python -m benchmarks gallery")
    return shown


def write_page(exhibits: Sequence[Exhibit], out: Path, command: str) -> None:
    """Write `index.html` to the folder of images, with the exhibits grouped by section."""
    sections = groupby(exhibits, lambda exhibit: exhibit.section)
    body = "".join(
        f'<h2>{html.escape(name)}</h2><div class="grid">{"".join(map(_figure, some))}</div>\n'
        for name, some in sections
    )
    text = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>hrc_env: gallery</title><style>{STYLE}</style></head><body>\n"
        f"<h1>People beside a robot</h1>\n{body}"
        f"<footer>Made by <code>{html.escape(command)}</code></footer></body></html>\n"
    )
    (out / "index.html").write_text(text, encoding="utf-8")


def _figure(exhibit: Exhibit) -> str:
    title, caption = html.escape(exhibit.title), html.escape(exhibit.caption)
    return (
        f"<figure{' class=wide' if exhibit.is_wide else ''}>"
        f'<img src="{html.escape(exhibit.file)}" alt="{title}: {caption}" loading="lazy">'
        f"<figcaption><b>{title}</b> <span>{caption}</span></figcaption></figure>\n"
    )
