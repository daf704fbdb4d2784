"""The site is whole: every page is found, every name and picture is shown, every link leads on."""

import dataclasses
import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest

import hrc_env
from docs import declared, names, records, rst, site
from hrc_env import PUBLIC
from hrc_env.tasks import BUILT_IN

DOCS = Path(site.__file__).parent
PAGES = sorted(path for path in DOCS.rglob("*.md"))
TOCTREE = re.compile(r"```\{toctree\}\n(.*?)```", re.S)
PICTURE = re.compile(r"!\[([^\]]*)\]\((?:\.\./)*(?:docs/)?pictures/([^)]+)\)")
IS_INSTALLED = all(importlib.util.find_spec(module) for module in site.NEEDED)


def page_name(path: Path) -> str:
    return path.relative_to(DOCS).with_suffix("").as_posix()


def listed(path: Path) -> list[str]:
    """The pages that a page's tables of contents list."""
    lines = [line for block in TOCTREE.findall(path.read_text()) for line in block.splitlines()]
    found = [line for line in lines if line and not line.startswith(":")]
    return [page_name(path.parent / f"{line}.md") for line in found]


def test_every_page_is_in_one_table_of_contents():
    found = [name for path in PAGES for name in listed(path)]
    assert sorted(found) == sorted({page_name(path) for path in PAGES} - {"index"})


def test_every_public_name_has_an_entry():
    found = [
        name
        for title in names.groups()
        for name in re.findall(r"^## (\w+)$", names.page(title), re.M)
    ]
    assert sorted(found) == sorted(PUBLIC)
    assert len(names.groups()) >= 10


def test_every_picture_is_shown_with_a_caption_in_the_gallery():
    shown = {name: alt for alt, name in PICTURE.findall((DOCS / "gallery.md").read_text())}
    assert shown.keys() == {path.name for path in (DOCS / "pictures").iterdir()}
    assert all(shown.values())
    elsewhere = {name for path in PAGES if path.stem != "gallery"
                 for _, name in PICTURE.findall(path.read_text())}  # fmt: skip
    readme = {name for _, name in PICTURE.findall((DOCS.parent / "README.md").read_text())}
    assert shown.keys() == elsewhere | readme


@pytest.mark.parametrize("task_id", BUILT_IN)
def test_an_environment_has_the_sections_that_gymnasium_has(task_id):
    text = (DOCS / "reference" / f"{task_id}.md").read_text()
    assert re.findall(r"^## (.+)$", text, re.M) == [
        "Description", "Action space", "Observation space", "Rewards", "Cost", "Starting state",
        "Episode end", "Arguments", "Version history",
    ]  # fmt: skip
    assert text.index(f"pictures/{task_id}.webp") < text.index("## Description")


def test_no_comment_begins_a_line_of_a_sentence():
    """Markdown would show the rest of the line as it is written."""
    for path in PAGES:
        assert re.findall(r"(?<=[^\n>])\n<!-- number:.*", path.read_text()) == [], path


def test_fields_are_shown_as_they_are_declared():
    found = {field.name: field for field in declared.fields(hrc_env.EnvConfig)}
    assert list(found) == [field.name for field in dataclasses.fields(hrc_env.EnvConfig)]
    assert found["estimator"].annotation == "EstimatorChoice"
    assert found["perception"].default == "'pixels'"
    assert found["render_mode"].default == "None"
    assert found["scene"].doc.startswith("Name of the ")
    assert declared.fields(hrc_env.PPOSettings)
    assert {field.name for field in declared.fields(hrc_env.Task)} >= {"id", "config_type"}


def test_the_page_of_records_has_every_field_with_its_meaning():
    text = records.page()
    kinds = [kind for several in records.list_records().values() for kind in several]
    used = (hrc_env.Belief, hrc_env.EnvInfo, hrc_env.EstimatorSpec, hrc_env.Keypoints,
            hrc_env.PoseEstimate, hrc_env.ResetOptions, hrc_env.Robot, hrc_env.Task)  # fmt: skip
    assert set(used) <= set(kinds)
    for kind in kinds:
        _, _, section = text.partition(f"### {kind.__name__}\n")
        section = section.partition("\n#")[0]
        for field in declared.fields(kind):
            assert re.search(rf"^\| `{field.name}` \| `.+` \|.*\| \S.* \|$", section, re.M), field


def test_signatures_name_arrays_by_their_aliases():
    arguments, returns = declared.signature(hrc_env.forecast)
    assert (arguments.split(":")[0], returns) == ("(now", "PoseEstimate")
    arguments, _ = declared.signature(hrc_env.HRCVectorEnv.__init__)
    assert arguments.startswith("(num_envs: int, *, ")
    assert "= AutoresetMode.NEXT_STEP, " in arguments
    assert arguments.endswith(", **arguments: Any)")
    assert declared.signature(hrc_env.smooth)[0].startswith("(P: Floats, ")


def test_docstrings_become_what_sphinx_reads():
    text = rst.from_docstring(
        "Give a `Task` and `x=1` to *it* and x*y* (docs/start.md).\n\n    go(1)\n\nOf `Task`s.\n\n"
        "Args:\n    task: a `Task`.\n"
    )
    task = ":py:obj:`Task <hrc_env.Task>`"
    assert text == (
        f"Give a {task} and ``x=1`` to *it* and x\\*y\\* (:doc:`/start`).\n"
        "\n.. code-block:: python\n\n   go(1)\n\n\n"
        f"Of {task}\\ s.\n\nArgs:\n    task: a {task}.\n"
    )


def test_links_of_a_site_are_followed(tmp_path):
    (tmp_path / "a.html").write_text(
        '<h1 id="top"></h1><a href="#top"></a><a href="b.html#in"></a><a href="b.html#out"></a>'
        '<a href="c.html"></a><img src="https://x.org/y.png"><a href="https://x.org"></a>'
        '<link rel="stylesheet" href="site.css"><a href="http:"></a>'
    )
    (tmp_path / "b.html").write_text('<p id="in"></p>')
    assert site.broken_links(tmp_path) == [
        "a.html loads https://x.org/y.png",
        "a.html: b.html#out has no such section",
        "a.html: c.html leads nowhere",
        "a.html: http: is no address",
        "a.html: site.css leads nowhere",
    ]


def test_what_the_site_needs_is_named(monkeypatch, capsys):
    monkeypatch.setattr(site, "NEEDED", {"no_such_module": "no-such-package"})
    assert site.main() == 2
    assert "no-such-package: pip install -e '.[docs]'" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(not IS_INSTALLED, reason="the extra docs is not installed")
def test_the_site_is_built_without_a_warning(tmp_path):
    done = subprocess.run([sys.executable, "-m", "docs.site", str(tmp_path)],
                          capture_output=True, text=True, cwd=DOCS.parent)  # fmt: skip
    assert done.returncode == 0, done.stderr
    built = {path.relative_to(tmp_path).with_suffix("").as_posix()
             for path in tmp_path.rglob("*.html")}  # fmt: skip
    assert {page_name(path) for path in PAGES} <= built
    entries = "".join(path.read_text() for path in (tmp_path / "reference/api").iterdir())
    for name in PUBLIC:
        assert f'id="hrc_env.{name}"' in entries or name in rst.MODULES, name
    assert 'id="hrc_env.EnvConfig.perception"' in entries
    assert "Attributes:" not in entries, "fields are shown twice"
    assert not re.findall(r"@import|url\(['\"]?http", (DOCS / "_static" / "site.css").read_text())
