"""Everything that workers can do, one scene after the other, by people small and tall."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from benchmarks.motion.statistics import (
    ANKLES,
    HEAD,
    WRISTS,
    grips,
    knee_flexion_deg,
    misses,
    slips,
    wholly_there,
)
from hrc_env.motion import controls as c
from hrc_env.motion import state as st
from hrc_env.motion.repertoire import REPERTOIRE, SCENES, make_worker, perform
from hrc_env.worker.body import SEGMENT, load_body, worker_names
from hrc_env.worker.props import PROP_NAMES, PROPS

DT_S = 0.01
STATURES_M = (1.55, 1.75, 1.92)
STRETCHED = ("walk 1.8 m/s",)
"""Scenes in which the legs of the smallest come to their full stretch, at which bodies jerk."""


def of_stature(stature_m):
    """The first worker, smaller or larger (the baked ones differ in shape as well)."""
    body = load_body()
    scale = stature_m / body.stature_m
    return replace(
        body,
        stature_m=stature_m,
        rest_position=body.rest_position * scale,
        joint_offset=body.joint_offset * scale,
        capsule_ends=body.capsule_ends * scale,
        capsule_radius_m=body.capsule_radius_m * scale,
    )


@pytest.fixture(scope="module", params=list(REPERTOIRE))
def scene(request):
    """The films of a scene by three people, right-handed but for the last."""
    played = []
    for k, stature_m in enumerate(STATURES_M):
        me = make_worker(of_stature(stature_m), (0.3, -0.2), 0.7, right=k < 2)
        played.append(perform(REPERTOIRE[request.param], me, np.random.default_rng(k), DT_S))
    return request.param, played


def each(scene):
    """All films of a scene."""
    return [film for films in scene[1] for film in films]


def test_hands_are_where_they_work_and_on_what_they_hold(scene):
    for film in each(scene):
        missed = misses(film)
        if missed.size:
            assert np.percentile(missed, 99) < 0.025
            assert (missed > 0.01).mean() < 0.1


@pytest.mark.parametrize("name", worker_names())
@pytest.mark.parametrize("held", ["board in both hands", "wheelbarrow", "cart"])
def test_arms_of_every_body_reach_what_they_carry_and_push(name, held):
    me = make_worker(load_body(name))
    films = perform(REPERTOIRE[held], me, np.random.default_rng(0), 0.04)
    assert (np.concatenate([misses(film) for film in films]) > 0.01).mean() <= 0.02


def test_it_begins_and_ends_standing_still(scene):
    for film in each(scene):
        speed = np.linalg.norm(film.motion.velocity_world[:, 0], axis=-1)
        assert speed[[0, -1]].max() < 0.2  # swaying
        height = film.motion.position_world[[0, -1], 0, 0, 2]
        assert height[1] == pytest.approx(height[0], abs=0.01)


def test_nothing_jumps(scene):
    for film in each(scene):
        velocity = film.motion.velocity_world[:, 0]
        moved = np.diff(film.motion.position_world[:, 0], axis=0) / DT_S
        assert np.abs(moved - 0.5 * (velocity[1:] + velocity[:-1])).max() < 0.35
        rate = np.linalg.norm(np.diff(velocity, axis=0), axis=-1) / DT_S
        most = 140.0 if scene[0] in STRETCHED else 70.0
        assert rate[:, [0, 3, *HEAD]].max() < most
        assert np.percentile(rate[:, WRISTS], 99.9) < most
        assert np.percentile(rate[:, ANKLES], 99.9) < 95.0  # the walk at 1.8 m/s


def test_one_activity_takes_over_where_the_last_one_ended(scene):
    for films in scene[1]:
        for before, after in pairwise(films):
            gap = before.controls[-1, : c.N_BLENDED] - after.controls[0, : c.N_BLENDED]
            assert np.abs(np.delete(gap, c.HEADING)).max() < 0.35  # blended in 0.45 s
            if before.controls[-1, c.PROP] > 0 and after.controls[0, c.PROP] > 0:
                held = before.controls[-1, c.PROP_POSE :] - after.controls[0, c.PROP_POSE :]
                assert np.abs(held).max() < 0.01


def test_loaded_feet_do_not_slide_and_none_is_in_the_floor(scene):
    for film in each(scene):
        slip = slips(film)
        assert np.percentile(slip, 95) < 0.05
        toes = film.motion.position_world[:, 0, [SEGMENT["left_toes"], SEGMENT["right_toes"]], 2]
        assert toes.min() > toes[0].min() - 0.003


def test_joints_stay_within_what_people_can_do(scene):
    for film in each(scene):
        place = film.motion.position_world[:, 0]
        for side in ("left", "right"):
            assert knee_flexion_deg(place, side).min() > -1.0
            assert knee_flexion_deg(place, side).max() < 150.0
            upper, fore, hand = (
                place[:, SEGMENT[f"{side}_{n}"]] for n in ("upper_arm", "forearm", "hand")
            )
            a, b = fore - upper, hand - fore
            cosine = (a * b).sum(-1) / np.linalg.norm(a, axis=-1) / np.linalg.norm(b, axis=-1)
            assert np.degrees(np.arccos(cosine.clip(-1, 1))).max() < 155.0
            knee = place[:, SEGMENT[f"{side}_shank"], 2]
            assert knee.min() > 0.03
        assert np.abs(film.controls[:, c.HEAD_YAW]).max() < 1.4
        assert np.abs(film.controls[:, c.HEAD_PITCH]).max() < 1.2
        assert np.abs(film.controls[:, c.SPINE_FLEX]).max() < 1.6


def test_what_is_held_is_in_a_hand(scene):
    for film in each(scene):
        held, hands = film.motion.held, grips(film)
        there = wholly_there(film)
        for kind in np.unique(held.kind):
            if kind == 0 or film.activity in (*st.TAKING, *st.GIVING, st.PUSH, st.CARRY):
                continue  # loads stand by themselves before and after; boards lie on shoulders
            when = (held.kind[:, 0] == kind) & there.any(1)
            apart = np.linalg.norm(hands[when] - held.position_world[when], axis=-1).min(1)
            reach = np.nanmax(np.linalg.norm(PROPS[kind].grips, axis=-1))
            assert apart.max() < reach + 0.02, PROP_NAMES[kind]


def test_nobody_falls_over(scene):
    """The middle of pelvis and chest stays over the feet, give or take a step."""
    for film in each(scene):
        place = film.motion.position_world[:, 0]
        feet = place[:, [*ANKLES, SEGMENT["left_toes"], SEGMENT["right_toes"]], :2].mean(1)
        trunk = 0.5 * (place[:, 0, :2] + place[:, 3, :2])
        assert np.linalg.norm(trunk - feet, axis=-1).max() < 0.45


def test_every_activity_has_a_scene():
    shown = {activity for acts in SCENES.values() for activity, _, _ in acts}
    elsewhere = {st.REACH, st.LIFT, st.CLIP}  # test_hands.py, test_playing.py
    assert shown | elsewhere == set(range(len(st.ACTIVITY_NAMES)))
