"""Files that come inside an archive of the npm registry: a plain download, no node needed."""

import shutil
import urllib.request
from pathlib import Path

from hrc_env.core.errors import DownloadError

PATIENCE_S = 60.0
"""How long the server may be silent."""


def download_tarball(url: str, folder: Path, again: str) -> Path:
    """An archive, put into a folder.

    Args:
        url: where it is.
        folder: where it is put.
        again: the command with which one tries once more.

    Raises:
        DownloadError: no network, or no such file.
    """
    place = folder / url.rsplit("/", 1)[-1]
    try:
        with urllib.request.urlopen(url, timeout=PATIENCE_S) as answer, place.open("wb") as file:
            shutil.copyfileobj(answer, file)
    except OSError as error:
        raise DownloadError(
            f"Could not download {url} (is there a network?): {error}. Try again with: {again}"
        ) from error
    return place
