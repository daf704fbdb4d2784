"""Random generators that come of others, quickly: an episode takes five."""

import functools
from typing import Any

import numpy as np
from numpy.random.bit_generator import ISpawnableSeedSequence, SeedSequence
from numpy.typing import NDArray

WORDS = 4
"""64-bit words that a generator starts from."""


class _Words(ISpawnableSeedSequence):
    """What a generator starts from, drawn: to have `SeedSequence` hash it takes five times as long
    as everything else. Has its attributes, of which other streams are made (`appearance`)."""

    spawn_key = ()

    def __init__(self, words: NDArray[np.uint64]) -> None:
        self.words = words

    @property
    def entropy(self) -> list[int]:
        """What a `SeedSequence` is made from."""
        return self.words.tolist()

    def generate_state(self, n_words: int, dtype: Any = np.uint64) -> NDArray[Any]:
        """The words, as they are, to the generator they were drawn for."""
        if n_words == WORDS and np.dtype(dtype) == np.uint64:
            return self.words
        return self._sequence.generate_state(n_words, dtype)

    def spawn(self, n_children: int) -> list[Any]:
        """What children start from; nothing is drawn for them."""
        return self._sequence.spawn(n_children)

    @functools.cached_property
    def _sequence(self) -> SeedSequence:
        return SeedSequence(self.entropy)


def aside(rng: np.random.Generator, number: int) -> np.random.Generator:
    """A generator that depends on where `rng` came from, and not on what was drawn from it; `rng`
    stays as it is. Each purpose has a `number` of its own, far above the count of children."""
    seeds: Any = rng.bit_generator.seed_seq
    key = (*seeds.spawn_key, number)
    return np.random.default_rng(SeedSequence(seeds.entropy, spawn_key=key))


def children(rng: np.random.Generator, n: int) -> list[np.random.Generator]:
    """n generators that start from numbers which `rng` draws; others each time."""
    drawn = rng.integers(0, 2**64, (n, WORDS), np.uint64)
    seeds: list[Any] = [_Words(words) for words in drawn]
    return [np.random.Generator(np.random.PCG64(seed)) for seed in seeds]
