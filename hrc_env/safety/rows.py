"""Rows n.J qd <= b: how fast a robot's capsules may come nearer to segments of estimated bodies.

Of every pair, n is the unit vector from the robot's nearest point to the body's, and

    D = gap - margin - Z_d - v_h T_h,   Z_d = max(least, predicted + k seen + k' max(seen - s', 0))

with v_h the estimated speed of the body's point along -n, and sigma_n = sqrt(n' Sigma n) the root
of predicted^2 + seen^2. Of `ShieldConfig` are k `sigmas`, k' `doubtful_sigmas`, s' `doubtful_m`,
least `least_sigmas_m`, T_h `human_s`; the margin is `margin_m` or `hand_margin_m`. Of what was not
seen for a while, as in late images, much of the deviation is the prediction's, which is wide; one
that is large all the same is of a part that one camera carries, whose errors are larger than it
says. Where D >= 0 the robot may be as fast as
it can brake within D (the robot's share of `separation.protective_distance`); else it has to get
away. A row that no command within reach exceeds is left out.

From a segment that may be touched nothing has to get away while it comes no faster than its region
bears in a touch: capsules that may touch it brake within gap - margin - Z_d to a speed that both
together keep below that; of others a point may come at `still_m_s`, where D allows less.

Who has not been seen for a while may be anywhere within a walk of where they were: that is taken
off D, too, and who may be within D the robot comes no nearer to, nor flees from. The same holds for
people on floor that no camera has seen empty.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import HAND_SEGMENTS, SEGMENT_ENDS, SEGMENT_RADIUS_M
from hrc_env.core.typing import Ints
from hrc_env.core.vacancy import POSSIBLE, STATURE_M
from hrc_env.geometry.chains import lever
from hrc_env.geometry.distances import closest_parameters

MOST_ROWS = 32
"""Of one robot; the tightest are kept."""
ABSENT_M = 1e3
"""A capsule that is farther away than this is of a load that is not carried [m]."""
RANKING_HZ = 1e-4
"""So fast a robot gets away from where somebody may have gone, D times this: hardly at all, but the
nearest pairs are the tightest rows [1/s]."""
SHORTEST_M = 0.1
"""A forearm that is estimated as shorter turns its hand no faster than if it were so long [m]."""
_N_LIMBS = len(SEGMENT_ENDS)
_JOINTS: Ints = np.array(
    [[(e[0], e[-1]) for e in ends[:2]] for ends in SEGMENT_ENDS]
    + [[(wrist, wrist)] * 2 for _, wrist, *_ in HAND_SEGMENTS]
)
"""(S, 2, 2) the two joints whose mean each end of a segment is; of a hand both ends its wrist."""
_REACHING: Ints = np.array([False] * 6 + [True] * 2 + [False] * 6 + [True] * 2)
"""(S,) forearms and hands."""


@kernel(makes_arrays=True)
def tightest_rows(robot, bodies, settings, rows):
    """Write the rows of every robot; of workers who are not known there are none.

    Args:
        robot: link frames (B, N, 4, 4), which joints are slides (N,), each capsule's link (K,),
            capsules (B, K, 2, 3) and radii (K,) [m], least and greatest command within reach
            (B, N) [rad/s], slew (N,) [rad/s^2].
        bodies: segments (B, W, S, 2, 3) [m], joints' means and velocities (B, W, J, 3), covariances
            (B, W, J, 3, 3) and ages (B, W, J) [s], who is known (B, W), how far they may have gone
            since (B, W) [m], relative speeds of touches that are allowed, 0 of none (B, W, S), and
            the robot's share at most of each capsule's (K,) [m/s].
        settings: (1,) `config.SETTINGS`.
        rows: written: n.J (B, `MOST_ROWS`, N), b (B, `MOST_ROWS`) [m/s], how many (B,), and the
            least D of pairs that may matter (B,) [m]; infinite without.
    """
    frames, slides, link, capsules, radius, low, high, slew = robot
    segments, mean, velocity, cov, age_s, known, gone_m, touch_m_s, most_m_s = bodies
    J, b, count, least_m = rows
    p, n_caps, n_segments = settings[0], capsules.shape[1], segments.shape[2]
    rods, limbs = np.empty((n_caps, 5)), np.empty((n_segments, 5))
    normal, point, row = np.empty(3), np.empty(3), np.empty(len(slides))
    for e in range(len(capsules)):
        count[e], least_m[e] = 0, np.inf
        arm = frames[e], slides, low[e], high[e], slew
        for c in range(n_caps):
            _bound(capsules[e, c], radius[c], rods[c])
            rods[c, 4] = _stop_m(arm, link[c], capsules[e, c], p)
        for w in range(segments.shape[1]):
            if not known[e, w]:
                continue
            body = mean[e, w], velocity[e, w], cov[e, w]
            for s in range(n_segments):
                _bound(segments[e, w, s], SEGMENT_RADIUS_M[s], limbs[s])
                limbs[s, 4] = _most_taken_m(body, s, p) + gone_m[e, w]
            for c, s in np.ndindex(n_caps, n_segments):
                if _sphere_gap(rods[c], limbs[s]) > rods[c, 4] + limbs[s, 4]:
                    continue
                distance, t = _nearest(capsules[e, c], segments[e, w, s], point, normal)
                speed, sigma = _towards(body, s, t, normal)
                z_d = _z_d(sigma, _unseen_s(age_s[e, w], s), p) + gone_m[e, w]
                near = distance - radius[c] - SEGMENT_RADIUS_M[s] - _margin(s, p) - z_d
                clear = near - _travel(speed, p)
                least_m[e] = min(least_m[e], clear)
                fastest, slowing = _closing(arm, link[c], point, normal, row)
                slowing = min(slowing, p.deceleration_m_s2)
                bound = _allowed(clear, slowing, gone_m[e, w] > 0.0, p)
                left_m_s = touch_m_s[e, w, s] - max(speed, 0.0)
                if left_m_s > 0.0:
                    bound = max(bound, _touching(near, min(left_m_s, most_m_s[c]), slowing, p))
                if bound < fastest:
                    count[e] = _kept(row, bound, J[e], b[e], count[e])


@kernel(makes_arrays=True)
def floor_rows(robot, floor, settings, rows):
    """Add rows for people on floor that no camera has seen empty: a robot can brake before it.

    Args:
        robot, settings: as of `tightest_rows`.
        floor: centres of pieces (N, 3) [m], their states (B, N), and the distance from these at
            which hands may be (B,) [m].
        rows: those of `tightest_rows`.
    """
    frames, slides, link, capsules, radius, low, high, slew = robot
    (places, level, reach_m), (J, b, count, least_m) = floor, rows
    p, body = settings[0], np.empty((2, 3))
    rod, limb = np.empty(5), np.empty(5)
    normal, point, row = np.empty(3), np.empty(3), np.empty(len(slides))
    for e in range(len(capsules)):
        arm = frames[e], slides, low[e], high[e], slew
        for c in range(capsules.shape[1]):
            _bound(capsules[e, c], radius[c], rod)
            stop_m = _stop_m(arm, link[c], capsules[e, c], p)
            for n in range(len(places)):
                if level[e, n] != POSSIBLE:
                    continue
                body[0], body[1] = places[n], places[n]
                body[1, 2] += STATURE_M
                _bound(body, reach_m[e], limb)
                if _sphere_gap(rod, limb) > stop_m:
                    continue
                distance, _ = _nearest(capsules[e, c], body, point, normal)
                clear = distance - radius[c] - reach_m[e]
                least_m[e] = min(least_m[e], clear)
                fastest, slowing = _closing(arm, link[c], point, normal, row)
                bound = _allowed(clear, min(slowing, p.deceleration_m_s2), True, p)
                if bound < fastest:
                    count[e] = _kept(row, bound, J[e], b[e], count[e])


@kernel
def _bound(ends, radius, sphere):
    """Middle and radius of the sphere round a capsule."""
    squared = 0.0
    for i in range(3):
        sphere[i] = 0.5 * (ends[0, i] + ends[1, i])
        squared += (ends[1, i] - ends[0, i]) ** 2
    sphere[3] = 0.5 * math.sqrt(squared) + radius


@kernel
def _sphere_gap(one, other):
    dx, dy, dz = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    return math.sqrt(dx * dx + dy * dy + dz * dz) - one[3] - other[3]


@kernel
def _stop_m(arm, link, ends, p):
    """At most so much D is of matter to a capsule as fast as it can be [m]; to one that is absent,
    none. No point of it is faster than the faster end."""
    frames, slides, low, high, slew = arm
    fastest, longest_s = 0.0, 0.0
    for end in range(2):
        if abs(ends[end, 0]) > ABSENT_M:
            return -np.inf
        vx, vy, vz, either = 0.0, 0.0, 0.0, 0.0
        for i in range(link + 1):
            x, y, z = lever(frames[i], slides[i], ends[end])
            middle, half = 0.5 * (low[i] + high[i]), 0.5 * (high[i] - low[i])
            vx, vy, vz = vx + middle * x, vy + middle * y, vz + middle * z
            either += half * math.sqrt(x * x + y * y + z * z)
            longest_s = max(longest_s, max(abs(low[i]), abs(high[i])) / slew[i])
        fastest = max(fastest, math.sqrt(vx * vx + vy * vy + vz * vz) + either)
    return fastest * (p.reaction_s + 0.5 * max(fastest / p.deceleration_m_s2, longest_s))


@kernel
def _most_taken_m(body, s, p):
    """At most so much is taken off the gap of a segment, whatever the direction [m]."""
    mean, velocity, cov = body
    squared, variance = 0.0, 0.0
    for end in range(2):
        x, y, z = _end_velocity(mean, velocity, s, end)
        squared = max(squared, x * x + y * y + z * z)
        for k in range(2):
            S = cov[_JOINTS[s, end, k]]
            variance = max(variance, S[0, 0] + S[1, 1] + S[2, 2])
    sigma = math.sqrt(variance)
    return _margin(s, p) + sigma + _z_d(sigma, 0.0, p) + _travel(math.sqrt(squared), p)


@kernel
def _z_d(sigma, age_s, p):
    """Z_d [m] of a deviation along n [m] of what was seen last so long ago [s]."""
    predicted = min(sigma, p.predicted_m_s * age_s)
    seen = math.sqrt(sigma * sigma - predicted * predicted)
    doubt = p.doubtful_sigmas * max(0.0, seen - p.doubtful_m)
    return max(p.least_sigmas_m, predicted + p.sigmas * seen + doubt)


@kernel
def _margin(s, p):
    return p.hand_margin_m if _REACHING[s] else p.margin_m


@kernel
def _travel(speed, p):
    """The worker's [m], of an estimated speed towards the robot [m/s]."""
    if math.isnan(p.human_m_s):
        speed = max(speed, 0.0) + p.human_margin_m_s
    else:
        speed = p.human_m_s
    return speed * (p.human_s + p.latency_s)


@kernel
def _end_velocity(mean, velocity, s, end):
    """Of an end of a segment; the tip of a hand turns with its forearm."""
    one, two = velocity[_JOINTS[s, end, 0]], velocity[_JOINTS[s, end, 1]]
    x, y, z = 0.5 * (one[0] + two[0]), 0.5 * (one[1] + two[1]), 0.5 * (one[2] + two[2])
    if s >= _N_LIMBS and end == 1:
        elbow, wrist, reach, _ = HAND_SEGMENTS[s - _N_LIMBS]
        squared = 0.0
        for i in range(3):
            squared += (mean[wrist, i] - mean[elbow, i]) ** 2
        share, v = reach / max(math.sqrt(squared), SHORTEST_M), velocity[elbow]
        x, y, z = x + share * (x - v[0]), y + share * (y - v[1]), z + share * (z - v[2])
    return x, y, z


@kernel
def _unseen_s(age_s, s):
    """Time since any joint of a segment was seen [s]."""
    least = np.inf
    for end in range(2):
        for k in range(2):
            least = min(least, age_s[_JOINTS[s, end, k]])
    return least


@kernel
def _nearest(first, second, point, normal):
    """Distance of the axes of a robot's capsule and a body's, where along the second; the point on
    the first and the unit vector from there are written."""
    squared, u, t = closest_parameters(first[0], first[1], second[0], second[1])
    distance = math.sqrt(squared)
    for i in range(3):
        point[i] = first[0, i] + u * (first[1, i] - first[0, i])
        to = second[0, i] + t * (second[1, i] - second[0, i])
        normal[i] = (to - point[i]) / max(distance, 1e-6)
    return distance, t


@kernel
def _towards(body, s, t, normal):
    """A body's point at `t` of a segment: its speed along -n [m/s], its deviation along n [m]."""
    mean, velocity, cov = body
    nx, ny, nz = normal[0], normal[1], normal[2]
    speed, variance = 0.0, 0.0
    for end in range(2):
        share = t if end else 1.0 - t
        x, y, z = _end_velocity(mean, velocity, s, end)
        speed -= share * (nx * x + ny * y + nz * z)
        for k in range(2):
            S = cov[_JOINTS[s, end, k]]
            across = nx * (ny * S[0, 1] + nz * S[0, 2]) + ny * nz * S[1, 2]
            along = nx * nx * S[0, 0] + ny * ny * S[1, 1] + nz * nz * S[2, 2]
            variance += 0.5 * share * (along + 2.0 * across)
    return speed, math.sqrt(max(variance, 0.0))


@kernel
def _closing(arm, link, point, normal, row):
    """Write n.J of a point of a link; its greatest value within reach [m/s], and how fast the
    joints can take it down [m/s^2]."""
    frames, slides, low, high, slew = arm
    fastest, slowing = 0.0, 0.0
    for i in range(len(row)):
        row[i] = 0.0
        if i <= link:
            x, y, z = lever(frames[i], slides[i], point)
            row[i] = x * normal[0] + y * normal[1] + z * normal[2]
            fastest += max(row[i] * low[i], row[i] * high[i])
            slowing += abs(row[i]) * slew[i]
    return fastest, slowing


@kernel
def _allowed(clear, slowing, is_gone, p):
    """How fast a point may come nearer [m/s]; below 0: how fast it has to get away."""
    if clear < 0.0:
        return RANKING_HZ * clear if is_gone else max(-p.retreat_m_s, p.gain_hz * clear)
    return slowing * (math.sqrt(p.reaction_s**2 + 2.0 * clear / max(slowing, 1e-9)) - p.reaction_s)


@kernel
def _touching(near, touch_m_s, slowing, p):
    """The same where a touch at a speed of the robot is allowed; at 0, only to keep its place."""
    if touch_m_s == 0.0:
        return p.still_m_s
    braking = math.sqrt(touch_m_s**2 + 2.0 * slowing * max(near, 0.0)) - slowing * p.reaction_s
    return max(touch_m_s, braking)


@kernel
def _kept(row, bound, J, b, count):
    """Write a row where there is room, or over the loosest if that is looser; how many there are
    then."""
    at = count
    if count == MOST_ROWS:
        at = np.argmax(b)
        if b[at] <= bound:
            return count
    for i in range(len(row)):
        J[at, i] = row[i]
    b[at] = bound
    return max(count, at + 1)
