"""Rows: what they are by their definition, which pairs may be left out, how they differentiate."""

import math
from functools import cache

import numpy as np
import pytest

from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import JOINT
from hrc_env.core.vacancy import EMPTY, POSSIBLE, STATURE_M
from hrc_env.geometry import chains, shapes
from hrc_env.geometry.distances import closest_parameters
from hrc_env.geometry.enclosure import (
    CAPSULES,
    N_CAPSULES,
    enclose,
    find_velocities,
    load_enclosure,
)
from hrc_env.geometry.inertia import find_mass_matrices
from hrc_env.safety.config import ShieldConfig
from hrc_env.safety.constraints import (
    MAX_CONSTRAINTS,
    RANKING_HZ,
    Bodies,
    Constraints,
    Robots,
    UnseenFloors,
    add_floor_constraints,
    add_worker_constraints,
)
from hrc_env.safety.contact import (
    CAPSULE_REGIONS,
    REGIONS,
    clamping_force,
    make_contact_limits,
    permitted_contact_speed,
)
from hrc_env.safety.error_bounds import (
    MAX_MISFIT,
    MAX_VIEWS,
    MIN_SHARE,
    ErrorBounds,
    find_support,
)
from hrc_env.scene.build import build
from hrc_env.scene.limits import robot_model, slew_rad_s2

RNG = np.random.default_rng(5)
CONFIG = ShieldConfig(margin="constant", latency_s=0.05)


def somebody(middle, speed_m_s=0.6):
    """(1, 1) an estimate of somebody upright near a place [m]."""
    heights = np.array([1.6, *np.repeat([1.4, 1.15, 1.0, 0.95, 0.5, 0.1, 0.05], 2)])
    sides = np.array([0, *np.outer([1, 1.3, 1.5, 0.5, 0.5, 0.5, 0.5], [1, -1]).ravel()])
    mean = np.stack([np.zeros(15), 0.18 * sides, heights], -1) + RNG.normal(0, 0.05, (15, 3))
    mean += np.array([*middle, 0.0])
    roots = RNG.normal(0, 0.05, (15, 3, 3))  # some of which are doubtful
    cov = roots @ roots.swapaxes(-1, -2) + 1e-4 * np.eye(3)
    velocity = RNG.normal(0, speed_m_s, (15, 3))
    return PoseEstimate(
        mean[None, None], cov[None, None], velocity[None, None],
        RNG.choice([0.0, 0.04], (1, 1, 15)), np.ones((1, 1), bool),
        n_views=RNG.integers(0, 5, (1, 1, 15)), misfit=RNG.uniform(0.0, 10.0, (1, 1, 15)),
        calibrated=np.ones((1, 1), bool),
    )  # fmt: skip


def before(scene, away_m):
    """(2,) a place so far in front of the tool."""
    return chains.tool_frame(scene.chain, scene.home_q)[:2, 3] + np.array([away_m, 0.0])


@cache
def model_of(scene):
    """The constants of a scene's robot."""
    return robot_model(scene, np.ones(scene.chain.n_joints))


def robots_of(scene, q, box):
    """One robot as the constraints need it."""
    (low, high, slew), chain, model = box, scene.chain, model_of(scene)
    frames = chains.link_frames(chain, q[None])
    inverse = model.invert_mass_matrices(frames, np.zeros(1))
    return Robots(
        frames, chain.slides, chain.capsule_link, chains.capsules(chain, q[None]),
        chain.capsule_radius_m, low[None], high[None], slew, inverse, model.obstacles,
    )  # fmt: skip


def no_constraints(chain, box):
    """Room for the constraints of one robot, of which there are none so far."""
    J, b = np.empty((1, MAX_CONSTRAINTS, chain.n_joints)), np.empty((1, MAX_CONSTRAINTS))
    return Constraints(J, b, np.zeros(1, np.int64), box[0][None], box[1][None], np.full(1, np.inf))


def shares():
    """(S, 2, T) how much each joint counts for an end of a segment, whatever its sign."""
    weights = np.abs(load_enclosure().weights)
    return weights / weights.sum(-1, keepdims=True)


def some_bounds():
    """Bounds of which some capsules, ages and expected errors have none."""
    rng = np.random.default_rng(3)
    shape = N_CAPSULES, 2, 3
    expected_m = np.sort(rng.uniform(0.0, 0.15, shape), axis=-1)
    expected_m[rng.random(shape[:2]) < 0.2] = -np.inf
    return ErrorBounds(
        np.array([0.02, 0.05]), rng.uniform(1.0, 2.0, (N_CAPSULES, len(MAX_VIEWS) + 1)),
        rng.uniform(1.0, 2.0, (N_CAPSULES, len(MAX_MISFIT) + 1)), expected_m,
        np.sort(rng.uniform(-0.05, 0.3, shape), axis=-1),
    )  # fmt: skip


def rows_of(scene, q, estimate, box, config=CONFIG, touches=(False, 0.0), gone_m=0.0, bounds=None):
    (may_touch, most_m_s), chain = touches, scene.chain
    capsules, params = enclose(estimate.mean_world), config.make_params()
    params = params._replace(bounds=bounds or params.bounds)
    bodies = Bodies(
        *capsules,
        find_velocities(capsules, estimate.mean_world, estimate.velocity_world),
        estimate.cov_world, estimate.age_s, estimate.tracked, np.full((1, 1), gone_m),
        may_touch | np.zeros((1, 1, N_CAPSULES), bool), make_contact_limits(CAPSULES),
        most_m_s + np.zeros(len(chain.capsule_link)), load_enclosure().joints, shares(),
        find_support(estimate, params.bounds),
    )  # fmt: skip
    found = no_constraints(chain, box)
    add_worker_constraints(robots_of(scene, q, box), bodies, params, found)
    n = int(found.n_rows[0])
    return found.J[0, :n], found.b[0, :n], found.clearance_m[0]


def bound_of(bounds, s, sigma, estimate):
    """The calibrated bound by its definition, or None."""
    joints = {
        j for j, share in zip(load_enclosure().joints[s].ravel(), shares()[s].ravel(), strict=True)
        if share > MIN_SHARE
    }  # fmt: skip
    n_views = min(estimate.n_views[0, 0, j] for j in joints)
    misfit = max(estimate.misfit[0, 0, j] for j in joints)
    age_s = max(estimate.age_s[0, 0, j] for j in joints)
    expected = sigma * bounds.view_factor[s, sum(n_views > limit for limit in MAX_VIEWS)]
    expected *= bounds.misfit_factor[s, sum(misfit > limit for limit in MAX_MISFIT)]
    for age, limit_s in enumerate(bounds.max_age_s):
        if age_s <= limit_s:
            rows = zip(bounds.expected_m[s, age], bounds.bound_m[s, age], strict=True)
            return next((bound for edge, bound in rows if expected <= edge), None)
    return None


def borne(scene, q, row, s, centre, n, radius_m, link):
    """Speeds [m/s] that a segment bears by the definition, free and as the robot touches it now."""
    model = model_of(scene)
    M = find_mass_matrices(
        scene.chain, model.inertias, chains.link_frames(scene.chain, q[None]), np.zeros(1)
    )[0]
    mass_kg = 1.0 / (row @ np.linalg.solve(M, row) + 1e-12)
    region = REGIONS[CAPSULE_REGIONS[CAPSULES[s]]]
    free = permitted_contact_speed(region.name, mass_kg)
    pressed = region.quasi_static_n * region.is_touched / clamping_force(region.name, 1.0, mass_kg)
    caps = zip(chains.capsules(scene.chain, q), scene.chain.capsule_radius_m, strict=True)
    links = scene.chain.capsule_link
    behind = [*model.obstacles, *(
        capsule_shape(*each) for each, of in zip(caps, links, strict=True) if of != link
    )]  # fmt: skip
    is_stuck = any(first_met_m(shape, centre, n) <= radius_m + region.min_gap_m for shape in behind)
    return free, pressed if is_stuck else np.inf


def capsule_shape(ends, radius_m):
    """A capsule as a row of a table of shapes."""
    table = np.empty((1, shapes.WIDTH))
    shapes.set_capsules(table, 0, ends[None], np.array([radius_m]))
    return table[0]


def first_met_m(shape, centre, n):
    """How far along n a shape begins; infinite if it is not met."""
    found = shapes.passage(shape[None], 0, centre - shape[shapes.CENTRE : shapes.AXES], n)
    return found.enter if found.leave >= max(found.enter, 0.0) else np.inf


def defined(scene, q, estimate, box, p, touches, bounds=None):
    """The rows by their definition, pair by pair, and the least D of all pairs."""
    (low, high, slew), (may_touch, most_m_s), chain = box, touches, scene.chain
    caps, enclosure = chains.capsules(chain, q), load_enclosure()
    body = enclose(estimate.mean_world)
    limbs, radii_m = body.ends_world[0, 0], body.radius_m[0, 0]
    moving = find_velocities(body, estimate.mean_world, estimate.velocity_world)[0, 0]
    cov, age_s = estimate.cov_world[0, 0], estimate.age_s[0, 0]
    found, least_m = [], np.inf
    for c in range(len(caps)):
        for s, name in enumerate(CAPSULES):
            squared, u, t = closest_parameters(*caps[c], *limbs[s])
            at, to = (x[0] + v * (x[1] - x[0]) for x, v in ((caps[c], u), (limbs[s], t)))
            n = (to - at) / math.sqrt(squared)
            v_h = -n @ ((1 - t) * moving[s, 0] + t * moving[s, 1])
            of_ends = (shares()[s][..., None, None] * cov[enclosure.joints[s]]).sum(1)
            Sigma = (1 - t) * of_ends[0] + t * of_ends[1]
            gap = math.sqrt(squared) - chain.capsule_radius_m[c] - radii_m[s]
            margin = p.hand_margin_m if name.endswith(("forearm", "hand")) else p.margin_m
            sigma = math.sqrt(n @ Sigma @ n)
            ages_s = age_s[enclosure.joints[s][shares()[s] > 0]]
            predicted = min(sigma, p.prediction_growth_m_s * ages_s.min())
            seen = math.sqrt(sigma**2 - predicted**2)
            z_d = (
                predicted
                + p.n_sigmas * seen
                + p.single_view_sigmas * max(seen - p.single_view_std_m, 0)
            )
            error = enclosure.protrusion_m[s] + max(z_d, p.min_uncertainty_m)
            calibrated = bound_of(bounds, s, sigma, estimate) if bounds else None
            error = error if calibrated is None else calibrated
            travel = (max(v_h, 0) + p.worker_speed_margin_m_s) * (p.worker_time_s + p.latency_s)
            clear = gap - margin - error - travel
            least_m = min(least_m, clear)
            row = n @ moved(chain, q, c, u)
            a = min(p.deceleration_m_s2, max(np.abs(row) @ slew, 1e-9))
            bound = max(-p.max_retreat_m_s, p.retreat_gain_hz * clear)
            if clear >= 0:
                bound = a * (math.sqrt(p.reaction_s**2 + 2 * clear / a) - p.reaction_s)
            link = chain.capsule_link[c]
            is_near = bound < np.maximum(row * low, row * high).sum()
            touch = is_near and may_touch[s]
            free, pressed = (
                borne(scene, q, row, s, to, n, radii_m[s], link) if touch else (0.0, 0.0)
            )
            left_m_s = free - max(v_h, 0)
            if left_m_s > 0:
                share_m_s = min(left_m_s, most_m_s[c], pressed)
                brakes = math.sqrt(share_m_s**2 + 2 * a * max(gap - margin - error, 0))
                allowed = max(share_m_s, brakes - a * p.reaction_s)
                bound = max(bound, allowed if share_m_s else p.creep_m_s)
            if bound < np.maximum(row * low, row * high).sum():
                found.append((bound, *row))
    return np.array(sorted(found)).reshape(-1, 1 + len(q)), least_m


def moved(chain, q, c, u, step=1e-6):
    """(3, N) how a point of a capsule moves with the joints, by differences."""

    def point(q):
        first, second = chains.capsules(chain, q)[c]
        return first + u * (second - first)

    steps = step * np.eye(len(q))
    return np.stack([(point(q + d) - point(q - d)) / (2 * step) for d in steps], -1)


@pytest.mark.parametrize("bounds", [None, some_bounds()], ids=["constant", "calibrated"])
@pytest.mark.parametrize("touched", [0.0, 0.5])
@pytest.mark.parametrize("robot", ["ur10e_like", "mobile_base"])
def test_rows_are_as_they_are_defined_and_none_that_matters_is_left_out(robot, touched, bounds):
    """Whether some segments may be touched, by some capsules at some speed, or none."""
    scene = build(robot=robot)
    chain, slew = scene.chain, slew_rad_s2(scene)
    several = 0
    for _ in range(40):
        q = scene.home_q + RNG.uniform(-0.6, 0.6, chain.n_joints)
        middle_m = chains.capsules(chain, q)[..., :2].reshape(-1, 2).mean(0)
        away = RNG.uniform(0.5, 1.6) * np.array([math.cos(a := RNG.uniform(-3, 3)), math.sin(a)])
        estimate = somebody(middle_m + away)
        middle = RNG.uniform(-0.5, 0.5, chain.n_joints) * chain.velocity_limit_rad_s
        low, high = middle - 0.3, middle + 0.3
        may_touch = RNG.random(N_CAPSULES) < touched
        most_m_s = RNG.choice([0.0, 0.25, np.inf], len(chain.capsule_link))
        given = scene, q, estimate, (low, high, slew), CONFIG, (may_touch, most_m_s)
        J, b, least_m = rows_of(*given, bounds=bounds)
        expected, all_m = defined(*given, bounds)
        np.testing.assert_allclose(np.sort(b), expected[:MAX_CONSTRAINTS, 0], atol=1e-6)
        if len(expected) <= MAX_CONSTRAINTS:
            rows = sorted(np.column_stack([b, J]).round(4).tolist())
            np.testing.assert_allclose(rows, sorted(expected.round(4).tolist()), atol=2e-4)
        several += len(b) > 3
        if len(b):
            assert least_m == pytest.approx(all_m)
    assert several > 5


def floor_rows_of(scene, q, places, level, reach_m, box, config=CONFIG):
    """The rows b, n.J of pieces of floor, the tightest first, and the least D."""
    floor = UnseenFloors(places, np.array([level]), np.array([reach_m]))
    found = no_constraints(scene.chain, box)
    add_floor_constraints(robots_of(scene, q, box), floor, config.make_params(), found)
    rows = np.column_stack([found.b[0], found.J[0]])[: found.n_rows[0]]
    return rows[rows[:, 0].argsort()], found.clearance_m[0]


@pytest.mark.parametrize("robot", ["ur10e_like", "mobile_base"])
def test_a_robot_can_brake_before_somebody_on_floor_that_no_camera_has_seen(robot):
    """By the rows' definition, capsule by capsule."""
    scene = build(robot=robot)
    chain, slew, reach_m = scene.chain, slew_rad_s2(scene), 0.3
    rng, several = np.random.default_rng(4), 0
    for _ in range(60):
        q = scene.home_q + rng.uniform(-0.6, 0.6, chain.n_joints)
        middle = rng.uniform(-0.5, 0.5, chain.n_joints) * chain.velocity_limit_rad_s
        low, high = middle - 0.3, middle + 0.3
        caps = chains.capsules(chain, q)
        foot = np.array([*caps[..., :2].reshape(-1, 2).mean(0) + rng.uniform(-0.9, 0.9, 2), 0.0])
        expected = []
        for c, axis in enumerate(caps):
            head = foot + np.array([0.0, 0.0, STATURE_M])
            squared, u, t = closest_parameters(*axis, foot, head)
            n = foot + t * (head - foot) - (axis[0] + u * (axis[1] - axis[0]))
            clear = math.sqrt(squared) - chain.capsule_radius_m[c] - reach_m
            row = n / math.sqrt(squared) @ moved(chain, q, c, u)
            a = min(CONFIG.deceleration_m_s2, max(np.abs(row) @ slew, 1e-9))
            bound = RANKING_HZ * clear
            if clear >= 0:
                bound = a * (math.sqrt(CONFIG.reaction_s**2 + 2 * clear / a) - CONFIG.reaction_s)
            if bound < np.maximum(row * low, row * high).sum():
                expected.append((bound, *row))
        places = np.stack([foot, caps[-1, 1] * (1.0, 1.0, 0.0)])
        levels = [POSSIBLE, EMPTY]
        rows, _ = floor_rows_of(scene, q, places, levels, reach_m, (low, high, slew))
        np.testing.assert_allclose(
            rows, np.array(sorted(expected)).reshape(-1, 1 + len(q)), atol=2e-4
        )
        several += len(rows) > 2
    assert several > 5


def test_who_is_not_tracked_has_no_rows():
    scene = build()
    estimate = somebody(before(scene, 0.4))
    box = -np.ones(6), np.ones(6), slew_rad_s2(scene)
    assert len(rows_of(scene, scene.home_q, estimate, box)[1])
    estimate.tracked[:] = False
    assert len(rows_of(scene, scene.home_q, estimate, box)[1]) == 0


def test_who_may_have_gone_anywhere_is_come_no_nearer_to_and_the_nearest_pairs_are_kept():
    scene = build()
    estimate = somebody(before(scene, 0.9), speed_m_s=0.0)
    box = -np.ones(6), np.ones(6), slew_rad_s2(scene)
    _, seen, least_m = rows_of(scene, scene.home_q, estimate, box)
    _, b, gone_least_m = rows_of(scene, scene.home_q, estimate, box, gone_m=3.0)
    assert gone_least_m == pytest.approx(least_m - 3.0)
    assert len(b) == MAX_CONSTRAINTS > len(seen)
    assert (b < 0.0).all()
    assert b.min() > -1e-3
    assert b.min() == pytest.approx(RANKING_HZ * gone_least_m)


def test_touches_are_allowed_as_fast_as_the_region_bears_less_the_workers_speed():
    scene = build()
    estimate = somebody(before(scene, 0.1), speed_m_s=0.0)
    box = -np.ones(6), np.ones(6), slew_rad_s2(scene)
    _, strict, _ = rows_of(scene, scene.home_q, estimate, box)
    assert strict.min() < 0.0
    estimate.mean_world[..., JOINT["nose"], 2] += 3.0  # the head, which must never be touched
    found = {}
    for most_m_s in (np.inf, 0.25, 0.0):
        given = scene, scene.home_q, estimate, box, CONFIG, (True, most_m_s)
        found[most_m_s] = rows_of(*given)[1].min()
    assert found[0.25] == pytest.approx(0.25)
    assert found[0.0] == pytest.approx(CONFIG.creep_m_s)
    assert found[np.inf] > 0.4
    estimate.velocity_world[..., 0] = -2.0
    _, b, _ = rows_of(*given)
    assert b.min() < 0.0


def test_a_part_that_one_camera_carries_is_kept_away_from_more_than_a_late_one():
    """The same deviation: of what is seen now it is doubted, of what was seen long ago it is the
    prediction's."""
    scene = build()
    estimate = somebody(before(scene, 0.5), speed_m_s=0.0)
    box = -np.ones(6), np.ones(6), slew_rad_s2(scene)
    estimate.cov_world[:] = 0.15**2 * np.eye(3)
    least_m = []
    for age_s in (0.0, 0.25):
        estimate.age_s[:] = age_s
        least_m.append(rows_of(scene, scene.home_q, estimate, box)[2])
    assert least_m[1] - least_m[0] == pytest.approx(2 * 0.15 + 5 * (0.15 - 0.08) - 0.15)
