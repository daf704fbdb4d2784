"""Fast derivation of random generators from other generators.

Every episode needs five generators.
"""

import functools
from typing import Any

import numpy as np
from numpy.random.bit_generator import ISpawnableSeedSequence, SeedSequence
from numpy.typing import NDArray

WORDS = 4
"""Number of 64-bit words that seed a generator."""


class _Words(ISpawnableSeedSequence):
    """A seed that consists of random words, which are used without hashing."""

    spawn_key = ()

    def __init__(self, words: NDArray[np.uint64]) -> None:
        self.words = words

    @property
    def entropy(self) -> list[int]:
        """The words, in the form that `SeedSequence` accepts."""
        return self.words.tolist()

    def generate_state(self, n_words: int, dtype: Any = np.uint64) -> NDArray[Any]:
        """Return the words unchanged, for the type of generator for which they were generated."""
        if n_words == WORDS and np.dtype(dtype) == np.uint64:
            return self.words
        return self._sequence.generate_state(n_words, dtype)

    def spawn(self, n_children: int) -> list[Any]:
        """Return seeds of child generators, without drawing random numbers for them."""
        return self._sequence.spawn(n_children)

    @functools.cached_property
    def _sequence(self) -> SeedSequence:
        return SeedSequence(self.entropy)


def aside(rng: np.random.Generator, number: int) -> np.random.Generator:
    """Return a generator that depends on the seed of `rng`, but not on the numbers drawn from it.

    Args:
        rng: the generator, which is not changed.
        number: number that identifies the purpose, unique and far above the number of children.
    """
    seeds: Any = rng.bit_generator.seed_seq
    key = (*seeds.spawn_key, number)
    return np.random.default_rng(SeedSequence(seeds.entropy, spawn_key=key))


def restart(rng: np.random.Generator, fresh: np.random.Generator) -> None:
    """Let `rng` go on with the numbers of `fresh`, a generator of the same kind.

    Generators from `aside` stay the same; what they decide for an episode is therefore kept.
    """
    rng.bit_generator.state = fresh.bit_generator.state


def children(rng: np.random.Generator, n: int) -> list[np.random.Generator]:
    """Return `n` generators with seeds drawn from `rng`; each call returns different ones."""
    drawn = rng.integers(0, 2**64, (n, WORDS), np.uint64)
    seeds: list[Any] = [_Words(words) for words in drawn]
    return [np.random.Generator(np.random.PCG64(seed)) for seed in seeds]
