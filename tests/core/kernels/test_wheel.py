"""A wheel may contain compiled kernels, for one version of Python and one platform."""

import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

from assets.kernels.wheel import KERNELS, build_wheel

PLACE = "hrc_env/core/kernels/compiled/"


@pytest.mark.slow
def test_a_wheel_contains_kernels_only_if_it_is_given_some(tmp_path):
    (tmp_path / "kernels").mkdir()
    (tmp_path / "kernels" / "one.nbc").write_bytes(b"code")
    build_wheel(tmp_path / "with", tmp_path / "kernels")
    build_wheel(tmp_path / "without")
    (with_one,), (pure,) = ((tmp_path / name).iterdir() for name in ("with", "without"))
    tag = f"cp{sys.version_info[0]}{sys.version_info[1]}-none-manylinux_2_17_x86_64"
    assert with_one.name.endswith(f"-{tag}.whl")
    assert pure.name.endswith("-py3-none-any.whl")
    assert ZipFile(with_one).read(f"{PLACE}one.nbc") == b"code"
    more = set(ZipFile(with_one).namelist()) - set(ZipFile(pure).namelist())
    assert more == {f"{PLACE}one.nbc"}
    assert not any("__pycache__" in name for name in ZipFile(with_one).namelist())


def test_the_hook_takes_them_from_the_same_variable():
    assert f'KERNELS = "{KERNELS}"' in Path("hatch_build.py").read_text()
