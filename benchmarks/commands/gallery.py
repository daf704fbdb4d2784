"""python -m hrc_env gallery: pictures of workers, motions and scenes, and a page of them."""

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from hrc_env.cli.checks import writable_folder
from hrc_env.cli.progress import progress_bar


@dataclass(frozen=True)
class Gallery:
    """Draw every worker, a film strip of every motion, and both scenes from all cameras."""

    out: Path = Path("out/gallery")
    """Folder for the pictures (PNG) and `index.html`."""

    def run(self) -> int:
        """Draw, tell where."""
        writable_folder(self.out)
        from benchmarks.gallery.gallery import GalleryConfig, run

        console = Console()
        with progress_bar(console, "gallery") as say:
            exhibits = run(GalleryConfig(), self.out, say)
        console.print(f"{len(exhibits)} pictures; open [bold]{self.out / 'index.html'}[/]")
        return 0
