"""A finished part is used again only while everything it depends on is the same."""

import hashlib
import shutil
from pathlib import Path

import pytest

from hrc_env.experiments.study import fingerprint
from hrc_env.experiments.study.fingerprint import fingerprint_of, source_digest, sources_of

TRIAL = "hrc_env.experiments.impact.episodes"


def test_settings_and_makers_count():
    assert fingerprint_of({"n": 1}, TRIAL) == fingerprint_of({"n": 1}, TRIAL)
    assert fingerprint_of({"n": 1}, TRIAL) != fingerprint_of({"n": 2}, TRIAL)
    assert fingerprint_of({"n": 1}, TRIAL) != fingerprint_of({"n": 1}, "hrc_env.metrics")


def test_everything_that_is_imported_counts_and_nothing_else():
    package = Path(fingerprint.__file__).parents[2]
    found = {path.relative_to(package).as_posix() for path in sources_of(TRIAL)}
    assert {"simulation.py", "core/streams.py", "worker/props.py", "core/records.py"} <= found
    assert not [name for name in found if name.startswith(("cli/", "experiments/lab"))]


def test_a_module_of_somebody_else_is_refused():
    with pytest.raises(ModuleNotFoundError, match="numpy"):
        sources_of("numpy")


@pytest.fixture
def copied(tmp_path, monkeypatch):
    """A small package and its data where the repository's would be."""
    package = tmp_path / "hrc_env"
    (package / "room").mkdir(parents=True)
    (package / "maker.py").write_text("def f():\n    from hrc_env.room import organ\n")
    (package / "room" / "organ.py").write_text("import numpy\nimport hrc_env.deep\n")
    (package / "deep.py").write_text("X = 1\n")
    (package / "other.py").write_text("X = 1\n")
    (package / "room" / "beside.py").write_text("from . import organ\nfrom ..deep import X\n")
    assets = tmp_path / "assets" / "workers"
    assets.mkdir(parents=True)
    (assets / "worker_1.npz").write_bytes(b"painted")
    monkeypatch.setattr(fingerprint, "_PACKAGE", package)
    monkeypatch.setattr("hrc_env.worker.body.assets_dir", lambda: tmp_path / "assets")
    yield tmp_path
    shutil.rmtree(tmp_path)
    fingerprint._imports.cache_clear()
    fingerprint._surroundings.cache_clear()


def of_now() -> str:
    fingerprint._imports.cache_clear()
    fingerprint._surroundings.cache_clear()
    return fingerprint_of({}, "hrc_env.maker")


def test_a_repainted_worker_is_seen_anew(copied):
    before = of_now()
    (copied / "assets" / "workers" / "worker_1.npz").write_bytes(b"repainted")
    assert of_now() != before


def test_what_is_entered_in_the_leaderboard_makes_nothing_anew(copied):
    before, folder = of_now(), copied / "hrc_env" / "experiments" / "benchmark" / "entries"
    folder.mkdir(parents=True)
    (folder / "mine.json").write_text("{}")
    assert of_now() == before


def test_deep_imports_are_followed_even_from_inside_a_function(copied):
    before = of_now()
    (copied / "hrc_env" / "other.py").write_text("X = 2\n")
    assert of_now() == before
    (copied / "hrc_env" / "deep.py").write_text("X = 2\n")
    assert of_now() != before


def test_what_lies_beside_an_installed_package_does_not_count(copied):
    (copied / "numpy.py").write_text("this is no Python that could be read")
    assert {path.name for path in sources_of("hrc_env.maker")} == {
        "maker.py",
        "organ.py",
        "deep.py",
    }


def test_the_file_of_what_somebody_registered_counts():
    here = Path(__file__).read_bytes()
    assert source_digest(test_settings_and_makers_count) == hashlib.sha256(here).hexdigest()
    assert source_digest(3) == ""


def test_relative_imports_are_followed(copied):
    names = {path.name for path in sources_of("hrc_env.room.beside")}
    assert names == {"beside.py", "organ.py", "deep.py"}
