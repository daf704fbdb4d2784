"""Generators that come of others: independent, repeatable, and they can be saved."""

import copy
import pickle

import numpy as np

from hrc_env.core.streams import children


def test_the_same_parent_has_the_same_children_and_then_others():
    first, again = (children(np.random.default_rng(5), 3) for _ in range(2))
    assert [rng.random() for rng in first] == [rng.random() for rng in again]
    parent = np.random.default_rng(5)
    elder, younger = children(parent, 3), children(parent, 3)
    assert len({rng.random() for rng in (*elder, *younger)}) == 6


def test_children_do_not_follow_each_other_or_their_parent():
    parent = np.random.default_rng(0)
    drawn = np.array([rng.standard_normal(20_000) for rng in (*children(parent, 5), parent)])
    correlation = np.corrcoef(drawn) - np.eye(6)
    assert np.abs(correlation).max() < 0.03
    assert np.abs(drawn.mean(1)).max() < 0.03


def test_a_copy_goes_on_and_has_the_same_children():
    (rng,) = children(np.random.default_rng(1), 1)
    rng.random(7)
    for other in (copy.deepcopy(rng), pickle.loads(pickle.dumps(rng))):
        assert other.random() == copy.deepcopy(rng).random()
        assert other.spawn(1)[0].random() == copy.deepcopy(rng).spawn(1)[0].random()


def test_what_is_spawned_leaves_the_generator_as_it_was():
    plain, asked = (children(np.random.default_rng(2), 1)[0] for _ in range(2))
    one, other = asked.spawn(2)
    assert one.random() != other.random()
    assert asked.random() == plain.random()
