"""Experiments with films, at the level that a test can afford."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from hrc_env.experiments.study import recording
from hrc_env.senses import make_senses


@pytest.fixture(scope="session")
def films_seen_at():
    """Within it, films are seen at a level: at keypoints, the emulator stands in for pixels."""

    @contextmanager
    def seen_at(level: str) -> Iterator[pytest.MonkeyPatch]:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(recording, "make_senses", lambda _, *rest: make_senses(level, *rest))
            yield patch

    return seen_at
