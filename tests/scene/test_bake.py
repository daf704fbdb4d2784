"""What the package reads is what the makers beside it write."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from assets.scenes.bake import ASSETS, bake


@pytest.mark.slow
def test_baking_again_writes_what_is_committed(tmp_path):
    bake(tmp_path)
    texts, pictures = sorted(tmp_path.rglob("*.xml")), sorted(tmp_path.rglob("*.png"))
    for path in texts:
        assert path.read_text() == committed(path, tmp_path).read_text(), path.name
    for path in pictures:
        before, now = (np.asarray(Image.open(each).convert("RGB"), int)
                       for each in (committed(path, tmp_path), path))  # fmt: skip
        assert np.abs(before - now).max() <= 1, path.name
    stored = {path.name for path in (ASSETS / "scenes" / "textures").glob("*.png")}
    assert stored == {path.name for path in pictures}


def committed(path: Path, folder: Path) -> Path:
    return ASSETS / path.relative_to(folder)
