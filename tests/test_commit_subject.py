"""The hook that refuses long subjects of commits."""

from pathlib import Path

import pytest

from tests.commit_subject import LONGEST, find_fault, main

RIGHT = {
    "a subject": "s" * LONGEST,
    "with a body": f"{'s' * LONGEST}\n\n{'b' * 100}\nmore\n",
    "with git's comments": f"\nSubject\n# {'c' * 100}\n\nBody\n# comment\n",
    "only comments": "# comment\n",
}
WRONG = {
    "one character more": "s" * (LONGEST + 1),
    "after comments and empty lines": "# comment\n\n" + "s" * 80 + "\n\nBody",
    "no empty line": "Subject\nBody",
}


@pytest.mark.parametrize("name", RIGHT)
def test_a_subject_that_fits_is_accepted(name):
    assert find_fault(RIGHT[name]) == ""


@pytest.mark.parametrize("name", WRONG)
def test_a_subject_that_does_not_fit_is_refused(name, tmp_path: Path, capsys):
    file = tmp_path / "COMMIT_EDITMSG"
    file.write_text(WRONG[name])
    assert main([str(file)]) == 1
    assert capsys.readouterr().err.strip() == find_fault(WRONG[name]) != ""
