"""Random generators derived from others, quickly: an episode takes five."""

import functools
from typing import Any

import numpy as np
from numpy.random.bit_generator import ISpawnableSeedSequence, SeedSequence
from numpy.typing import NDArray

WORDS = 4
"""Number of 64-bit words that seed a generator."""


class _Words(ISpawnableSeedSequence):
    """A seed that was drawn.

    To let `SeedSequence` hash it would take five times as long as everything else. It has the
    attributes of a `SeedSequence`, from which other streams are derived (`appearance`).
    """

    spawn_key = ()

    def __init__(self, words: NDArray[np.uint64]) -> None:
        self.words = words

    @property
    def entropy(self) -> list[int]:
        """The words as a `SeedSequence` takes them."""
        return self.words.tolist()

    def generate_state(self, n_words: int, dtype: Any = np.uint64) -> NDArray[Any]:
        """Return the words unchanged to the generator they were drawn for."""
        if n_words == WORDS and np.dtype(dtype) == np.uint64:
            return self.words
        return self._sequence.generate_state(n_words, dtype)

    def spawn(self, n_children: int) -> list[Any]:
        """Return seeds of child generators; nothing is drawn for them."""
        return self._sequence.spawn(n_children)

    @functools.cached_property
    def _sequence(self) -> SeedSequence:
        return SeedSequence(self.entropy)


def aside(rng: np.random.Generator, number: int) -> np.random.Generator:
    """Return a generator that depends on the seed of `rng`, but not on the numbers drawn from it.

    Args:
        rng: the generator, which stays as it is.
        number: the purpose; each has one of its own, far above the number of children.
    """
    seeds: Any = rng.bit_generator.seed_seq
    key = (*seeds.spawn_key, number)
    return np.random.default_rng(SeedSequence(seeds.entropy, spawn_key=key))


def children(rng: np.random.Generator, n: int) -> list[np.random.Generator]:
    """Return `n` generators with seeds drawn from `rng`; other ones at each call."""
    drawn = rng.integers(0, 2**64, (n, WORDS), np.uint64)
    seeds: list[Any] = [_Words(words) for words in drawn]
    return [np.random.Generator(np.random.PCG64(seed)) for seed in seeds]
