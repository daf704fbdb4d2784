"""What the package reads is what the makers beside it write."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from assets.scenes.bake import ASSETS, bake

NUMBER = re.compile(r"(?<=[\s\"])-?\d[\d.e+-]*(?=[\s\"])")


@pytest.mark.slow
def test_baking_again_writes_what_is_committed(tmp_path):
    bake(tmp_path)
    for path in sorted(tmp_path.rglob("*.xml")):
        before, now = committed(path, tmp_path).read_text(), path.read_text()
        assert NUMBER.sub("#", before) == NUMBER.sub("#", now), path.name
        numbers = [np.array(NUMBER.findall(text), float) for text in (before, now)]
        np.testing.assert_allclose(*numbers, atol=1e-9, rtol=0, err_msg=path.name)
    pictures = sorted(tmp_path.rglob("*.png"))
    for path in pictures:
        before, now = pixels(committed(path, tmp_path)), pixels(path)
        assert np.abs(before - now).max() <= 1, path.name
    stored = {path.name for path in (ASSETS / "scenes" / "textures").glob("*.png")}
    assert stored == {path.name for path in pictures}


def committed(path: Path, folder: Path) -> Path:
    return ASSETS / path.relative_to(folder)


def pixels(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB"), int)
