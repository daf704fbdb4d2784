"""Probes of the tracker: seeded people before four cameras, and every estimator that follows them.

People, cameras and detections are made here, so that nothing but the tracker can move the values.
Of each kind several sequences are followed at once; every third frame is kept as weighted means
over sequences and joints, and the last frame joint by joint.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.behaviour import doors
from tests.behaviour.probe import Played, Probe, Values, stack

Floats = NDArray[np.float64]

STEP_S = 0.04
SIZE_PX = (1920, 1080)
SIGMA_PX = 3.0
N_JOINTS = 15
MIRRORED = np.array([0, 2, 1, 4, 3, 6, 5, 8, 7, 10, 9, 12, 11, 14, 13])
"""The joint of the other side."""
EYES_M = np.array([(2.9, 2.6, 2.45), (-2.9, 2.5, 2.3), (-2.8, -2.6, 2.4), (2.9, -2.4, 2.2)])
SEEDS = (1, 2, 3, 4, 5, 6, 7, 8)
"""Each kind of sequence is played with these at once."""
N_SEEDS = len(SEEDS)
WEIGHTS = (1.0 + np.sin(1.7 * np.arange(N_JOINTS)) / 2) / N_JOINTS
"""Of joints in means: unequal, so that exchanged sides show."""
SEED_WEIGHTS = (1.0 + np.sin(2.3 * np.arange(N_SEEDS)) / 2) / N_SEEDS
"""Of sequences."""


# --- What cameras see ----------------------------------------------------------------------------


def hang_camera(eye_m: Floats, turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Floats:
    """Return a projection (3, 4) from a place towards the middle, then turned about x, y, z."""
    forward = np.array([0.2, 0.0, 1.0]) - eye_m
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(forward, right), forward]) @ _rotation(turn_rad).T
    K = np.array([[960.0, 0, 960], [0, 960, 540], [0, 0, 1]])
    return K @ np.column_stack([axes, -axes @ eye_m])


def _rotation(turn_rad: tuple[float, float, float]) -> Floats:
    """Return a rotation by small turns about the world's axes, one after the other."""
    out = np.eye(3)
    for k, angle in enumerate(turn_rad):
        a, b = (k + 1) % 3, (k + 2) % 3
        one = np.eye(3)
        one[a, a] = one[b, b] = np.cos(angle)
        one[b, a], one[a, b] = np.sin(angle), -np.sin(angle)
        out = one @ out
    return out


RIG = np.stack([hang_camera(eye) for eye in EYES_M])
ASKEW = np.stack([RIG[0], hang_camera(EYES_M[1], (0.038, 0.035, 0.017)), *RIG[2:]])
"""The same with the second camera turned by 3 degrees."""


def walk(
    seed: int, n_frames: int, speed_m_s: float = 1.1, size: float = 1.0, reach_rad: float = 0.0
) -> Floats:
    """Return joints (T, 15, 3) of somebody who walks in a curve, swings limbs, leans, reaches."""
    rng = np.random.default_rng([seed, 1])
    t = STEP_S * np.arange(n_frames)
    heading = rng.uniform(-np.pi, np.pi) + rng.uniform(0.4, 0.9) * speed_m_s * t
    heading += 0.3 * np.sin(1.3 * t + rng.uniform(0, 6))
    step = STEP_S * speed_m_s * np.stack([np.cos(heading), np.sin(heading)], -1)
    ground = rng.uniform(-0.5, 0.5, 2) + np.cumsum(step, 0) - step.sum(0) / 2
    body = _limbs(t, 4.5 * speed_m_s * t + rng.uniform(0, 6), reach_rad, rng)
    cos, sin = np.cos(heading)[:, None], np.sin(heading)[:, None]
    x, y = body[..., 0], body[..., 1]
    out = np.stack([cos * x - sin * y, sin * x + cos * y, body[..., 2]], -1) * size
    out[..., :2] += ground[:, None]
    return out


def _limbs(t: Floats, stride: Floats, reach_rad: float, rng: np.random.Generator) -> Floats:
    """Return joints (T, 15, 3) above the middle of the feet: forward, left, up."""
    body = np.zeros((len(t), N_JOINTS, 3))
    lean = 0.08 + 0.06 * np.sin(0.9 * t + rng.uniform(0, 6))
    wave = np.clip(np.sin(1.1 * t + rng.uniform(0, 6)), 0, 1)
    hips = 0.9 + 0.02 * np.cos(2 * stride)
    body[:, 0] = np.stack([0.12 + 0.65 * np.sin(lean), 0 * t, hips + 0.66 * np.cos(lean)], -1)
    for side, sign in ((0, 1.0), (1, -1.0)):
        swing = stride + (np.pi if side else 0.0)
        thigh = 0.4 * np.sin(swing)
        shank = thigh - 0.15 - 0.5 * np.clip(np.cos(swing), 0, 1) ** 2
        upper = reach_rad - 0.35 * np.sin(swing) + wave * (0.8 + 0.5 * np.sin(4 * t + side))
        fore = upper + 0.3 + 0.7 * wave
        hip = np.stack([0 * t, 0 * t + 0.1 * sign, hips], -1)
        shoulder = hip + np.stack([0.5 * np.sin(lean), 0 * t + 0.08 * sign, 0.5 * np.cos(lean)], -1)
        joints = [shoulder, _hang(shoulder, upper, 0.29), None, hip, _hang(hip, thigh, 0.4)]
        joints[2] = _hang(joints[1], fore, 0.26)
        ankle = _hang(joints[4], shank, 0.4)
        joints += [ankle, _hang(ankle, shank + 1.35, 0.18)]
        for k, points in enumerate(joints):
            body[:, 1 + 2 * k + side] = points
    body[..., 2] += np.maximum(0.02 - body[..., 2].min(-1), 0.0)[:, None]
    return body


def _hang(joint: Floats, angle: Floats, length_m: float) -> Floats:
    """Return the end of a limb that hangs from a joint at an angle."""
    return joint + length_m * np.stack([np.sin(angle), 0 * angle, -np.cos(angle)], -1)


def fall(seed: int, n_frames: int) -> Floats:
    """Return joints of somebody who falls over backwards or aside within half a second."""
    joints = walk(seed, n_frames, 0.3)
    share = np.clip((np.arange(n_frames) - 10) / 14, 0.0, 1.0)
    down = 0.5 * np.pi * share**2 * (3 - 2 * share)
    way = np.random.default_rng([seed, 2]).uniform(-np.pi, np.pi)
    axis = np.array([-np.sin(way), np.cos(way), 0.0])
    middle = joints.mean(1, keepdims=True) * [1, 1, 0]
    arm = joints - middle
    cos, sin = np.cos(down)[:, None, None], np.sin(down)[:, None, None]
    turned = cos * arm + sin * np.cross(axis, arm) + (1 - cos) * (arm @ axis)[..., None] * axis
    turned[..., 2] += np.maximum(0.03 - turned[..., 2].min(-1), 0.0)[:, None]
    return middle + turned


@dataclass(frozen=True, slots=True)
class Seen:
    """What cameras (C) give of people (W) in sequences (S), frame by frame (T)."""

    px: Floats
    """(T, S, C, W, 15, 2), NaN where nothing was found."""
    confidence: Floats
    sigma_px: Floats
    """(T, S, C, W, 15)."""
    time_s: Floats | None = None
    """(T, S, C) when frames were taken; None: now."""
    order: NDArray[np.int64] | None = None
    """(T, S, C, W) in which order people are given by cameras that know no names."""

    def frame(self, t: int) -> dict[str, Any]:
        """Return what an estimator is given in a frame."""
        given = {"px": self.px[t], "confidence": self.confidence[t], "sigma_px": self.sigma_px[t]}
        if self.order is not None:
            order = self.order[t][..., None]
            given = {
                name: np.take_along_axis(each, order[..., None] if name == "px" else order, 2)
                for name, each in given.items()
            }
        if self.time_s is not None:
            given["time_s"] = self.time_s[t]
        return given


def see(
    joints: Floats, P: Floats = RIG, gross: float = 0.0, gaps: float = 0.0, lasting_px: float = 0.0
) -> Seen:
    """Return noisy detections of joints (T, S, W, 15, 3).

    Args:
        joints: people [m].
        P: (C, 3, 4), as cameras really hang.
        gross: share of detections that are anywhere near.
        gaps: share of joints that a camera does not find for a while.
        lasting_px: standard deviation of errors that stay [px].
    """
    n_frames, n_sequences = joints.shape[:2]
    at = np.einsum("cij,tswkj->tscwki", P[:, :, :3], joints) + P[:, None, None, :, 3]
    exact, depth = at[..., :2] / at[..., 2:], at[..., 2]
    rngs = [np.random.default_rng([s, 3]) for s in range(n_sequences)]
    noise = np.stack([rng.standard_normal(exact[:, 0].shape) for rng in rngs], 1)
    lasting = np.stack([rng.standard_normal(exact[0, 0].shape) for rng in rngs])
    wrong = np.stack([rng.random(depth[:, 0].shape) for rng in rngs], 1)
    away = np.stack([rng.standard_normal(exact[:, 0].shape) for rng in rngs], 1)
    sure = np.stack([rng.uniform(0.3, 1.0, depth[:, 0].shape) for rng in rngs], 1)
    begins = np.stack(
        [rng.uniform(0, n_frames / max(gaps, 1e-9), depth[0, 0].shape) for rng in rngs]
    )
    px = exact + SIGMA_PX * noise + lasting_px * lasting
    px = np.where((wrong < gross)[..., None], px + 120 * away, px)
    found = (exact >= 0).all(-1) & (exact < SIZE_PX).all(-1) & (depth > 0.1)
    t = np.arange(n_frames).reshape(-1, *(1,) * 4)
    found &= ~((t >= begins) & (t < begins + 15))
    sigma_px = SIGMA_PX * (0.8 + 0.4 * sure)
    return _only(Seen(px, sure, sigma_px), found)


def _only(seen: Seen, found: NDArray[np.bool_]) -> Seen:
    """Return what is left of detections where only some are found, shape (T, S, C, W, 15)."""
    found = np.broadcast_to(found, seen.sigma_px.shape) & np.isfinite(seen.px[..., 0])
    return replace(
        seen,
        px=np.where(found[..., None], seen.px, np.nan),
        confidence=np.where(found, seen.confidence, 0.0),
        sigma_px=np.where(found, seen.sigma_px, np.inf),
    )


def _from_cameras(seen: Seen, shown: dict[tuple[int, int], tuple[int, ...]]) -> Seen:
    """Return detections where, from one frame to another, only some cameras find anything."""
    n_frames, _, n_cameras = seen.px.shape[:3]
    found = np.ones((n_frames, n_cameras), bool)
    for (first, last), which in shown.items():
        found[first:last] = np.isin(np.arange(n_cameras), which)
    return _only(seen, found[:, None, :, None, None])


def _exchanged(seen: Seen, frames: slice, which: list[int]) -> Seen:
    """Return detections in which some cameras exchange left and right for some frames."""
    px, sure, sigma = seen.px.copy(), seen.confidence.copy(), seen.sigma_px.copy()
    for c in which:
        for each in (px, sure, sigma):
            each[frames, :, c] = each[frames, :, c][:, :, :, MIRRORED]
    return replace(seen, px=px, confidence=sure, sigma_px=sigma)


def _walkers(n_frames: int, **how: Any) -> Floats:
    """Return one walker for each seed, (T, S, 1, 15, 3)."""
    return np.stack([walk(seed, n_frames, **how) for seed in SEEDS], 1)[:, :, None]


# --- Kinds of sequences --------------------------------------------------------------------------


def _plain() -> Seen:
    return see(_walkers(40), gaps=0.5, lasting_px=2.0)


def _one_view() -> Seen:
    """One camera alone for 3 s, then others again."""
    alone = {(0, 2): (), (10, 86): (1,), (86, 92): (1, 2)}
    return _from_cameras(see(_walkers(100, speed_m_s=0.7)), alone)


def _one_camera() -> Seen:
    """A rig of one camera, for long."""
    return see(_walkers(100, speed_m_s=0.7), gaps=0.5)


def _one_view_start() -> Seen:
    """One camera alone begins, at first not the same one; a second one comes late."""
    seen = see(_walkers(70, speed_m_s=0.8, size=1.06))
    return _from_cameras(seen, {(0, 2): (0,), (2, 4): (), (4, 58): (2,)})


def _one_limb() -> Seen:
    """One camera alone sees arms, then legs and the head, while two see the trunk."""
    joints = _walkers(90, speed_m_s=0.4, reach_rad=0.9)
    found = np.ones((90, 1, 4, 1, N_JOINTS), bool)
    found[6:60, :, 1:, :, 3:7] = False
    found[30:84, :, [0, 2, 3], :, 9:] = False
    found[40:70, :, [0, 1, 3], :, 0] = False
    return _only(see(joints), found)


def _few_twice(first: int) -> Seen:
    """One camera sees the whole body from a frame on; of others, each sees so many joints in some
    frames, none to four by sequence."""
    seen = see(_walkers(34, speed_m_s=0.5, reach_rad=0.3))
    found = np.zeros((34, N_SEEDS, 4, 1, N_JOINTS), bool)
    found[2:, :, 2] = True
    rng = np.random.default_rng(16)
    for t in range(2, 34):
        for s in range(N_SEEDS):
            if t % 4 == first or t > 29:
                which = rng.choice(N_JOINTS, (0, 1, 2, 2, 3, 3, 4, 2)[s], replace=False)
                for n, j in enumerate(which):
                    found[t, s, (0, 1, 3)[n % 3], 0, j] = True
    return _only(seen, found)


def _mirrored_start() -> Seen:
    return _exchanged(see(_walkers(36)), slice(0, 3), [0, 2])


def _mirrored_body() -> Seen:
    """Three cameras exchange sides at once, later one alone and then two."""
    seen = _exchanged(see(_walkers(50)), slice(12, 22), [0, 1, 2])
    return _exchanged(_exchanged(seen, slice(26, 32), [3]), slice(36, 40), [1, 2])


def _fallen() -> Seen:
    joints = np.stack([fall(seed, 80) for seed in SEEDS], 1)[:, :, None]
    return _from_cameras(see(joints), {(16, 72): (3,)})


def _running() -> Seen:
    return see(_walkers(40, speed_m_s=3.6), gaps=0.3)


def _outliers() -> Seen:
    return see(_walkers(40), gross=0.15, gaps=1.0, lasting_px=3.0)


def _lost() -> Seen:
    """Nobody is seen for longer than a track lasts; then somebody elsewhere."""
    joints = _walkers(66)
    joints[50:, ..., 0] -= 1.1
    return _from_cameras(see(joints), {(10, 14): (0,), (14, 52): ()})


def _jumping() -> Seen:
    """An arm is jerked, then a leg, then the whole body is elsewhere."""
    joints = _walkers(44, speed_m_s=0.5)
    joints[10:, :, :, 5] += [0.0, 0.4, 0.45]
    joints[20:24, :, :, [11, 13]] += [0.3, -0.2, 0.35]
    joints[30:] += [0.5, 0.55, 0.0]
    return _from_cameras(see(joints), {(26, 44): (0, 1, 2)})


def _askew() -> Seen:
    """Two cameras alone, one of which is turned; a third comes at last."""
    seen = see(_walkers(64), P=ASKEW)
    return _from_cameras(seen, {(0, 58): (0, 1)})


def _askew_later() -> Seen:
    """The same with a track that had begun before with good cameras."""
    straight, seen = see(_walkers(60)), see(_walkers(60), P=ASKEW)
    px = np.where(np.arange(60).reshape(-1, *(1,) * 5) < 10, straight.px, seen.px)
    return _from_cameras(replace(seen, px=px), {(10, 60): (0, 1)})


def _odd() -> Seen:
    """Detections that are none: absurd pixels, confidences and deviations; joints below floors."""
    joints = _walkers(30)
    joints[..., 2] -= 0.12
    seen = see(joints)
    seen.px[5:, :, 0, :, 3] = 1e6
    seen.px[5:, :, 1, :, 4] = np.inf
    seen.confidence[5:, :, 2, :, 5] = 1.2
    seen.confidence[5:, :, 0, :, 6] = -0.1
    seen.sigma_px[5:, :, 3, :, 0] = np.nan
    seen.sigma_px[5:, :, 3, :, 9] = 0.0
    seen.sigma_px[5:, :, 1, :, 10] = 0.01
    seen.sigma_px[5:, :, 2, :, 2] = 2e5
    seen.sigma_px[8:, :, 3, :, 11] = 40.0
    seen.confidence[:, 2, :, :, 4:] = 0.0
    return seen


def _late() -> Seen:
    """Cameras late by different times, one at half the rate; odd times."""
    seen = see(_walkers(36), gaps=0.3)
    out = _only(seen, np.zeros(seen.sigma_px.shape, bool))
    time_s = np.full((36, N_SEEDS, 4), np.nan)
    rng = np.random.default_rng(4)
    for c, delay in enumerate((0, 2, 3, 5)):
        for taken in range(0, 36 - delay, 2 if c == 1 else 1):
            if rng.random() < 0.08:
                continue
            now = taken + delay
            for name in ("px", "confidence", "sigma_px"):
                getattr(out, name)[now, :, c] = getattr(seen, name)[taken, :, c]
            time_s[now, :, c] = STEP_S * (taken + 1) - 0.009 * (c == 2)
    time_s[20, 0, 0] += 0.0008
    time_s[22, 0, 0] += 0.02
    time_s[24, 1, 3] = np.nan
    time_s[26, 1, 2] -= 0.7
    time_s[28, 2, 1] = time_s[26, 2, 1]
    return replace(out, time_s=time_s)


def _people() -> Seen:
    """Two who walk past each other; cameras know no names and lose one of them for a while."""
    t = np.arange(56)
    pairs = []
    for seed in SEEDS:
        people = []
        for k, sign in enumerate((1.0, -1.0)):
            joints = walk(10 * seed + k, 56, 0.3)
            joints[..., :2] -= joints[..., :2].mean(1, keepdims=True)
            joints[..., 0] += (sign * 0.7 * STEP_S * (t - 28))[:, None]
            joints[..., 1] += 0.3 * sign
            people.append(joints)
        pairs.append(np.stack(people, 1))
    seen = see(np.stack(pairs, 1), gross=0.03)
    found = np.ones((56, 1, 4, 2, N_JOINTS), bool)
    found[20:34, :, 1:, 1] = False
    found[24:30, :, 0, 1] = False
    found[:8, :, :, 1, :] = False
    found[40:, :, 2, 0, 6:] = False
    found[44:, :, 3, 0, 2:] = False
    rng = np.random.default_rng(6)
    order = np.stack([rng.permuted(np.tile([0, 1], (N_SEEDS, 4, 1)), axis=-1) for _ in t])
    return replace(_only(seen, found), order=order)


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """A kind of sequence, and with which settings of the tracker it is followed."""

    make: Callable[[], Seen]
    settings: dict[str, Any] = field(default_factory=dict)
    cameras: tuple[int, ...] = (0, 1, 2, 3)
    n_workers: int = 1
    horizons_s: tuple[float, ...] = (0.2,)
    is_short: bool = False


KINDS: dict[str, Kind] = {
    "plain": Kind(make=_plain, is_short=True, horizons_s=(0.1, 0.37, 1.0)),
    "one_view": Kind(make=_one_view, is_short=True),
    "one_view_start": Kind(make=_one_view_start),
    "one_limb": Kind(make=_one_limb),
    "mirrored_start": Kind(make=_mirrored_start),
    "mirrored_body": Kind(make=_mirrored_body),
    "fallen": Kind(make=_fallen),
    "running": Kind(make=_running),
    "outliers": Kind(make=_outliers),
    "lost": Kind(make=_lost),
    "jumping": Kind(make=_jumping),
    "askew": Kind(make=_askew),
    "askew_later": Kind(make=_askew_later),
    "odd": Kind(make=_odd),
    "late": Kind(make=_late, settings={"longest_delay_s": 0.3}),
    "people": Kind(make=_people, n_workers=2),
}
EAGER = {
    "look_every_s": 0.04, "open_depth_m": 0.02, "turn_std_rad": 1.5, "evidence_trust": 0.03,
    "least_weight": 1e-5,
}  # fmt: skip
"""Settings with which there are many hypotheses."""
SURE = EAGER | {"sigma_scale": 0.3, "noise_bounds": (1.0, 1.0)}
"""Settings with which limbs' mirror images are told apart."""
TREES: dict[str, Kind] = {
    "eager": Kind(make=_one_view, settings=EAGER),
    "eager_limbs": Kind(make=_one_limb, settings=SURE),
    "eager_parts": Kind(make=_one_view, settings=SURE),
    "eager_camera": Kind(make=_one_camera, cameras=(1,), settings=EAGER),
    "one_camera": Kind(make=_one_camera, cameras=(2,)),
    "on_floor": Kind(make=_one_view_start, settings={"stands_std_m": 0.1, "wait_updates": 2}),
    "few_twice": Kind(make=partial(_few_twice, 2)),
    "few_twice_eager": Kind(make=partial(_few_twice, 3), settings=EAGER),
    "only_limbs": Kind(make=_one_limb, settings={"mirrored_parts": ("limbs",)}),
    "honest": Kind(make=_plain, settings={"noise_bounds": (2.0, 2.0), "gauss_newton_steps": 3}),
    "white": Kind(make=_outliers, settings={"noise_share": 0.0, "sigma_scale": 1.2}),
}
"""Of estimators that fit a whole body."""
CLOUDS: dict[str, Kind] = {
    "passes": Kind(make=_running, settings={"n_iterations": 2, "n_particles": 200}),
    "placed": Kind(
        make=_plain, settings={"place_m": ((-1.0, 1.0), (-2.0, 2.0), (0.0, 2.0)), "sigma_m": 0.03}
    ),
}
"""Of the paper's estimator."""
ESTIMATORS = ("particle", "kalman", "paper", "paper_restarts", "triangulation", "ransac")
N_PARTICLES = 150
"""Of the paper's estimators, in most sequences."""


# --- Playing -------------------------------------------------------------------------------------


def follow(estimator: str, kind: Kind, _: Values) -> Played:
    """Play the sequences of a kind through an estimator."""
    seen, P = kind.make(), RIG[list(kind.cameras)]
    settings = {**kind.settings}
    if "paper" in estimator and kind.make is not _plain:
        settings = {"n_particles": N_PARTICLES, **settings}
    n_frames, n_sequences = seen.px.shape[:2]
    shape = (n_sequences, kind.n_workers)
    tracker = doors.Tracker(estimator, P, STEP_S, shape, settings)
    moments: list[dict[str, Any]] = []
    for t in range(n_frames):
        frame = {name: each[:, list(kind.cameras)] for name, each in seen.frame(t).items()}
        tracker.predict(STEP_S if t != 7 else 0.6 * STEP_S)
        pose = None
        if kind.n_workers > 1:
            frame, pose = tracker.assign_people(frame)
        tracker.update(frame)
        if t == n_frames - 4:
            tracker.reset(np.array([1]))
        if t % 3 == 0 or t == n_frames - 1:
            moments.append(_moment(tracker, estimator, pose))
    values = {name: np.einsum("s,ts...->t...", SEED_WEIGHTS, each * 1.0)
              for name, each in stack(moments).items()}  # fmt: skip
    values |= _joint_by_joint("last", tracker.estimate())
    for horizon_s in kind.horizons_s:
        values |= _joint_by_joint(f"ahead_{horizon_s:g}", tracker.forecast(horizon_s))
    if "longest_delay_s" in kind.settings:
        values["ignored"] = tracker.count_ignored()
    return Played(_shrunk(values))


def _moment(tracker: doors.Tracker, estimator: str, pose: Any) -> dict[str, Any]:
    """Return what is kept of one frame."""
    kept = _means_of_joints(tracker.estimate())
    if estimator in ("particle", "kalman"):
        held = tracker.hypotheses()
        kept |= {f"held/{name}": _shortened(name, value) for name, value in held.items()}
    if pose is not None:
        kept["pose"] = pose
    return kept


def _means_of_joints(belief: dict[str, Any]) -> dict[str, Any]:
    factor = np.linalg.cholesky(belief["cov_world"])[..., *np.tril_indices(3)]
    return {
        "mean_m": np.einsum("j,bwji->bwi", WEIGHTS, belief["mean_world"]),
        "std_m": np.einsum("j,bwji->bwi", WEIGHTS, factor),
        "velocity_m_s": np.einsum("j,bwji->bwi", WEIGHTS, belief["velocity_world"]),
        "age_s": belief["age_s"] @ WEIGHTS,
        "tracked": belief["tracked"],
    }


def _joint_by_joint(prefix: str, belief: dict[str, Any]) -> Values:
    """Return a belief joint by joint, (15, ...), as means over sequences."""
    factor = np.linalg.cholesky(belief["cov_world"])[..., *np.tril_indices(3)]
    names = {"mean_m": "mean_world", "velocity_m_s": "velocity_world", "age_s": "age_s"}
    values = {**{new: belief[name] for new, name in names.items()}, "std_m": factor}
    return {
        f"{prefix}/{name}": np.einsum("s,swj...->jw...", SEED_WEIGHTS, value)
        for name, value in values.items()
    }


SPARSE = ("slope", "offset_m", "noise_sums", "noise_factor", "bone_m", "bone_std_m", "speed_std",
          "conflicts", "offset_count")  # fmt: skip
"""Values of all joints of which a weighted sum is kept."""


def _shortened(name: str, value: NDArray[Any]) -> NDArray[Any]:
    """Return a value of what an estimator holds, summed over joints where that is much."""
    if name not in SPARSE:
        return value
    inner = np.cos(np.arange(np.prod(value.shape[3:]))).reshape(value.shape[3:])
    weighed = value * inner * WEIGHTS.reshape(-1, *(1,) * (value.ndim - 3))
    return weighed.reshape(*value.shape[:2], -1).sum(-1)


def _shrunk(values: Values) -> Values:
    """Return values without axes of length 1 beside the first."""
    return {
        name: np.asarray(each).reshape(len(each), *(n for n in np.shape(each)[1:] if n > 1))
        for name, each in values.items()
    }


# --- What stands beside the estimators -----------------------------------------------------------


def smooth(_: Values) -> Played:
    """Play the offline smoother on a few of the clips."""
    values: Values = {}
    for name in ("plain", "one_view", "lost", "askew_later"):
        seen = KINDS[name].make()
        clip = [seen.frame(t) for t in range(0, 40, 2)]
        clip = [{name: each[:3] for name, each in frame.items()} for frame in clip]
        belief = doors.smooth_clip(RIG, clip, STEP_S)
        means = _means_of_joints({key: each.reshape(-1, *each.shape[2:])
                                  for key, each in belief.items()})  # fmt: skip
        for key, each in means.items():
            by_frame = (each * 1.0).reshape(len(clip), 3, *each.shape[1:])
            kept = np.einsum("s,ts...->t...", SEED_WEIGHTS[:3], by_frame)
            values[f"{name}/{key}"] = kept[::2]
    return Played(_shrunk(values))


def assign_poses(n_cameras: int, _: Values) -> Played:
    """Play who gets which pose: beliefs near and far, poses of all qualities, newcomers, nobody."""
    rng, n, n_people, n_workers = np.random.default_rng([15, n_cameras]), 700, 4, 3
    bodies = np.concatenate([walk(seed, 30, size=0.9 + 0.03 * seed) for seed in range(1, 9)])
    joints = bodies[rng.integers(0, len(bodies), (n, n_people))]
    joints[..., :2] -= joints[..., :2].mean(-2, keepdims=True)
    joints[..., :2] += rng.uniform(-1.3, 1.3, (n, n_people, 1, 2))
    joints[:, 1] = joints[:, 0] + rng.normal(0, 0.35, (n, 1, 3)) * [1, 1, 0]
    joints[:60, 3] *= rng.uniform(0.4, 1.8, (60, 1, 1))
    off_m = rng.normal(size=(n, n_workers, 1, 3)) * rng.choice(
        [0.01, 0.1, 0.3, 0.7], (n, n_workers, 1, 1)
    )
    std_m = rng.choice([0.01, 0.04, 0.15], (n, n_workers, 1, 1, 1))
    mean = joints[:, :n_workers] + off_m * [1, 1, 0.2] + 0.05 * rng.normal(size=off_m.shape)
    belief = {
        "mean_world": mean, "cov_world": std_m**2 * np.eye(3) * np.ones((N_JOINTS, 1, 1)),
        "velocity_world": 0 * mean, "age_s": np.zeros(mean.shape[:-1]),
        "tracked": rng.random((n, n_workers)) < 0.6,
    }  # fmt: skip
    seen = see(joints[None], P=RIG[:n_cameras])
    shape = seen.px.shape[:-2]
    gross = rng.random(seen.sigma_px.shape) < rng.choice([0.0, 0.2, 0.45, 0.7], (*shape, 1))
    px = np.where(gross[..., None], seen.px + rng.normal(0, 90, seen.px.shape), seen.px)
    px += rng.normal(0, 1, (*shape, 1, 2)) * rng.choice([0.0, 8.0, 30.0], (*shape, 1, 1))
    is_exchanged = rng.random(shape) < 0.2
    px = np.where(is_exchanged[..., None, None], px[..., MIRRORED, :], px)
    missing = rng.choice([0.0, 0.3, 0.6, 0.8, 1.0], (*shape, 1), p=[0.5, 0.2, 0.15, 0.1, 0.05])
    found = _only(replace(seen, px=px), rng.random(seen.sigma_px.shape) >= missing)
    order = rng.permuted(np.tile(np.arange(n_people), (1, n, n_cameras, 1)), axis=-1)
    frame = replace(found, order=order).frame(0)
    return Played({"pose": doors.associate_people(RIG[:n_cameras], belief, frame)})


def look_for_people(by_search: bool, _: Values) -> Played:
    """Play what is known of who is unknown, through tracks that come, go and stay away."""
    rng = np.random.default_rng(7)
    shape, n_cameras = (6, 2), 3
    presence = doors.Presence(shape, n_cameras, STEP_S)
    tracked, lost_s = np.zeros(shape, bool), np.zeros(shape)
    moments: list[dict[str, Any]] = []
    for t in range(420):
        if t in (60, 200, 330):
            tracked = rng.random(shape) < 0.5
        if t in (100, 240):
            tracked[:] = False
        lost_s = np.where(tracked & (t % 90 < 60), 0.0, lost_s + STEP_S)
        joints = rng.normal([1.0, 0.0, 1.0], 1.0, (*shape, N_JOINTS, 3))
        belief = {
            "mean_world": joints, "cov_world": np.tile(0.01 * np.eye(3), (*shape, 15, 1, 1)),
            "velocity_world": 0 * joints, "tracked": tracked,
            "age_s": np.minimum(lost_s, 5.0)[..., None] + np.zeros(N_JOINTS),
        }  # fmt: skip
        shown = rng.random((6, n_cameras, 2)) < (0.3 if 40 < t < 70 or 130 < t < 140 else 0.0)
        shown |= (tracked & (lost_s == 0.0))[:, None]
        more = shown | (rng.random(shown.shape) < (0.02 if t > 280 else 0.0))
        looked = rng.random((6, n_cameras)) < [[1.0], [0.9], [0.5], [0.1], [0.03], [1.0]]
        looked[5, 1:] = False
        age_s = rng.choice([0.0, 0.04, 0.2, 1.3], (6, n_cameras), p=[0.8, 0.1, 0.09, 0.01])
        if t == 300:
            presence.forget(np.array([0, 3]))
        said = presence.look(
            belief, _shown(more), _shown(shown), looked, age_s, by_search
        )  # fmt: skip
        seen_m = np.where(np.isfinite(said["seen_world"]), said["seen_world"], -9.0)
        moments.append({
            "unknown": said["unknown"], "blind_s": said["blind_s"],
            "seen_m": np.einsum("j,bwji->bwi", WEIGHTS, seen_m),
        })  # fmt: skip
    values = stack(moments)
    numbers = {name: values[name][::7] for name in ("blind_s", "seen_m")}
    return Played({"unknown": values["unknown"], **numbers})


LOOKS = np.ones((8, 3))
"""How often each of three cameras searches its whole image, in eight places."""
LOOKS[1, 2] = LOOKS[2, 1] = LOOKS[2, 2] = LOOKS[6] = 0.0
LOOKS[3] = 0.5


def look_over_floor(_: Values) -> Played:
    """Play what is known of floor that different cameras see, with people beyond the slots and
    people whom no track explains."""
    rng, shape, n_cameras = np.random.default_rng(16), (8, 2), 3
    sees = np.array([[1, 1, 1], [1, 1, 0], [0, 1, 1], [1, 0, 0], [0, 0, 0]], bool)
    presence = doors.Presence(shape, n_cameras, STEP_S, sees)
    tracked, lost_s = np.zeros(shape, bool), np.zeros(shape)
    moments: list[dict[str, Any]] = []
    for t in range(300):
        if t in (70, 180):
            tracked = rng.random(shape) < 0.4
        if t in (100, 220):
            tracked[:] = False
        lost_s = np.where(tracked, 0.0, lost_s + STEP_S)
        belief = {
            "mean_world": np.zeros((*shape, N_JOINTS, 3)),
            "cov_world": np.tile(0.01 * np.eye(3), (*shape, N_JOINTS, 1, 1)),
            "velocity_world": np.zeros((*shape, N_JOINTS, 3)), "tracked": tracked,
            "age_s": np.minimum(lost_s, 5.0)[..., None] + np.zeros(N_JOINTS),
        }  # fmt: skip
        own = np.repeat(tracked[:, None], n_cameras, 1)
        looked = rng.random((8, n_cameras)) < LOOKS
        stranger = np.zeros((8, n_cameras), bool)
        stranger[4, :2], stranger[5, 2] = 40 <= t < 48, 30 <= t % 90 < 34
        stranger[7] = rng.random(n_cameras) < 0.3
        others_m = np.full((8, 4, 3), np.nan)
        if 130 <= t < 150:
            others_m[3, 0] = 0.3
        said = presence.look(
            belief, _shown(own), _shown(own), looked, np.zeros((8, n_cameras)), False,
            own.any(-1) | stranger, stranger, others_m,
        )  # fmt: skip
        moments.append({"unknown": said["unknown"], "tracked": said["tracked"],
                        **presence.describe_floor()})  # fmt: skip
    values = stack(moments)
    return Played({**values, "level_age_s": values["level_age_s"][::5]})


def explain_people(_: Values) -> Played:
    """Play whom a track explains: bodies of all sizes, near it or far off, with many joints or few,
    before cameras some of which are turned."""
    rng, n = np.random.default_rng(18), 240
    bodies = np.concatenate([walk(seed, 30, size=0.95 + 0.01 * seed) for seed in SEEDS])
    joints = bodies[rng.integers(0, len(bodies), (n, 1))]
    joints = joints * rng.choice([0.5, 0.7, 1.0, 1.0, 1.2, 1.6], (n, 1, 1, 1))
    velocity = rng.normal(0, 0.6, (n, 1, 1, 3)) + np.zeros_like(joints)
    off_m = rng.normal(size=(n, 1, 1, 3)) * rng.choice([0.0, 0.05, 0.1, 0.2, 0.6], (n, 1, 1, 1))
    age_s = rng.choice([0.0, 0.1, 0.3, np.nan], (n, 4))
    seen = see(joints[None], P=RIG)
    wrong = see(joints[None], P=ASKEW)
    px = np.where(rng.random((n, 1, 1, 1, 1)) < 0.3, wrong.px[0], seen.px[0])
    few = rng.random(seen.confidence.shape[1:]) < rng.choice([0.1, 0.7, 0.9], (n, 4, 1, 1))
    sigma_px = rng.choice([3.0, 10.0, 40.0], (n, 4, 1, 1)) + np.zeros(N_JOINTS)
    frame = {"px": px, "confidence": np.where(few, 0.2, 0.9), "sigma_px": sigma_px}
    belief = {
        "mean_world": joints + off_m, "velocity_world": velocity,
        "cov_world": np.tile(1e-4 * np.eye(3), (n, 1, N_JOINTS, 1, 1)),
        "age_s": np.zeros((n, 1, N_JOINTS)), "tracked": rng.random((n, 1)) < 0.9,
    }  # fmt: skip
    return Played(doors.find_unexplained_people(RIG, np.full(4, 960.0), frame, age_s, belief))


def _shown(who: NDArray[np.bool_]) -> dict[str, Any]:
    """Return frames in which cameras show some people (B, C, W), by one joint at least."""
    confidence = np.zeros((*who.shape, N_JOINTS))
    confidence[..., 4] = 0.7 * who
    return {"px": np.zeros((*confidence.shape, 2)), "confidence": confidence,
            "sigma_px": np.ones(confidence.shape)}  # fmt: skip


def watch_cameras(_: Values) -> Played:
    """Play cameras that are turned, zoomed, rolled, late or stuck, and what is thought of them."""
    f = 960.0
    K, shift = np.array([[f, 0, 960], [0, f, 540], [0, 0, 1]]), np.eye(3)
    rolled, zoomed = shift.copy(), K @ np.diag([1.02, 1.02, 1.0]) @ np.linalg.inv(K)
    rolled[:2, :2] = [[np.cos(0.03), -np.sin(0.03)], [np.sin(0.03), np.cos(0.03)]]
    rolled = (
        K @ np.linalg.inv(np.diag([f, f, 1.0])) @ rolled @ np.diag([f, f, 1.0]) @ np.linalg.inv(K)
    )
    shift = shift + np.array([[0, 0, 9.0], [0, 0, -7.0], [0, 0, 0]])
    rigs = [RIG.copy() for _ in range(N_SEEDS)]
    for b, (c, wrong) in enumerate(
        ((1, shift), (2, zoomed), (3, rolled), (0, 3 * shift - 2 * np.eye(3)))
    ):
        rigs[b][c] = wrong @ RIG[c]
    joints = _walkers(330, speed_m_s=0.5)
    people = [see(joints[:, b : b + 1], P=rigs[b]) for b in range(N_SEEDS)]
    names = ("px", "confidence", "sigma_px")
    frames = {name: np.concatenate([getattr(each, name) for each in people], 1) for name in names}
    for name in names:
        each = frames[name]
        each[100:, 4, 1] = each[97:-3, 4, 1].copy()
        each[60:90, 5, 2] = each[60, 5, 2]
        each[90, 5, 2], each[92:99, 5, 2] = each[61, 5, 2], each[92, 5, 2]
        each[200:, 0] = getattr(see(joints[200:, :1]), name)[:, 0]
    velocity = np.gradient(joints, STEP_S, axis=0)
    watchers = doors.Watchers(N_SEEDS, RIG, np.tile([960.0, 540.0, f], (4, 1)))
    moments: list[dict[str, Any]] = []
    for t in range(330):
        seen = {name: each[t].copy() for name, each in frames.items()}
        is_live = watchers.leave_out_stuck(seen)
        belief = {
            "mean_world": joints[t] + 0.004, "velocity_world": velocity[t],
            "cov_world": np.tile(1e-4 * np.eye(3), (N_SEEDS, 1, N_JOINTS, 1, 1)),
            "age_s": np.zeros((N_SEEDS, 1, N_JOINTS)), "tracked": np.ones((N_SEEDS, 1), bool),
        }  # fmt: skip
        belief["tracked"][6] = t % 50 < 25
        age_s = np.zeros((N_SEEDS, 4))
        age_s[4, 1] = 0.12 if t >= 100 else 0.0
        thought = watchers.monitor(seen, age_s, belief)
        if t == 250:
            watchers.forget(np.array([1]))
        moments.append({"is_live": is_live, "found": np.isfinite(seen["px"]).sum((-1, -2, -3)),
                        **thought})  # fmt: skip
    values = stack(moments)
    for name in ("ratio", "score"):
        values[name] = values[name][9::30] * (1.0 if name == "ratio" else 1e-3)
    values["suspected"] = values["suspected"][9::10]
    return Played(values)


def believe_without_cameras(_: Values) -> Played:
    """Play the beliefs that no camera makes."""
    joints = _walkers(3)
    truth = doors.believe_truth(joints[0], joints[1] - joints[0])
    prior = doors.believe_prior((2, 1))
    thin = {**truth, "cov_world": truth["cov_world"] * np.arange(1, 9).reshape(-1, 1, 1, 1, 1) ** 6}
    thin["mean_world"] = truth["mean_world"].copy()
    thin["mean_world"][2:5, :, [2, 8]] = thin["mean_world"][2:5, :, [1, 7]] + 0.005  # no heading
    thin["tracked"][1] = False
    for horizon_s in (0.05, 0.3, 0.7, 1.0):
        ahead = _joint_by_joint(f"ahead_{horizon_s:g}", doors.forecast_belief(thin, horizon_s))
        truth |= ahead
    return Played({f"truth/{name}": each for name, each in truth.items()} | prior)


# --- Geometry ------------------------------------------------------------------------------------

LENSES: dict[str, dict[str, Any]] = {
    "pinhole": {"field_deg": 70.0, "roll_deg": 12.0},
    "own": {"focal_px": (900.0, 1000.0), "centre_px": (950.0, 560.0)},
    "brown": {"lens": "brown_conrady", "coefficients": (-0.28, 0.09, 0.0012, -0.0008, -0.012),
              "field_deg": 84.0},
    "brown_out": {"lens": "brown_conrady", "coefficients": (0.1, -0.02), "width_px": 1280,
                  "height_px": 720},
    "fisheye": {"lens": "kannala_brandt", "coefficients": (0.0667,), "field_deg": 118.2},
    "fisheye_wide": {"lens": "kannala_brandt", "coefficients": (-0.02, 0.006, -0.003, 0.0004),
                     "field_deg": 190.0, "roll_deg": -30.0},
}  # fmt: skip
"""Cameras with all that a lens may be."""


def look_through_lenses(_: Values) -> Played:
    """Play pixels and rays of every kind of camera, the middle, the edges and beyond."""
    rng = np.random.default_rng(8)
    edges = [[960.0, 540.0], [0.0, 0.0], [1920.0, 1079.9], [-900.0, 4000.0]]
    px = np.concatenate([rng.uniform([-200, -150], [2100, 1250], (40, 2)), edges])
    points = rng.uniform([-3, -3, 0], [3, 3, 2.5], (30, 3))
    values: Values = {}
    for k, (name, described) in enumerate(LENSES.items()):
        place = {"eye_m": tuple(EYES_M[k % 4]), "target_m": (0.1 * k, 0.0, 0.9)}
        camera = doors.Camera(**place, **described)
        at, depth = doors.project_points(camera.P[None], points[None])
        image = camera.to_image(at[0, 0])
        found = {
            "camera": np.concatenate([camera.K.ravel(), camera.P.ravel(), camera.pose.ravel()]),
            "resized": np.concatenate([camera.resized(640, 640), camera.resized(320, 100)]),
            "lens": np.nan_to_num(camera.lens_row, posinf=1e9),
            "rays": camera.rays(px), "projected": at[0, 0], "depth_m": depth[0, 0],
            "image": np.where(depth[0, 0, :, None] > 0.1, image, 0.0),
            "pinhole": camera.to_pinhole(px), "magnification": camera.magnification(at[0, 0]),
            "shows": camera.shows(np.array([*px, (0, 0), camera.K[:2, 2] * 2, (3.0, 1e-9)])),
        }  # fmt: skip
        found["magnification"] = np.where(depth[0, 0] > 0.1, found["magnification"], 1.0)
        values |= {f"{name}/{key}": np.asarray(each) for key, each in found.items()}
    values["down"] = doors.look_at(np.array([1.0, 2, 3]), np.array([1.0, 2, 0]))
    return Played(values)


def triangulate(_: Values) -> Played:
    """Play points of views, agreeing or not, some missing, behind cameras or in line with two."""
    seen = see(_walkers(3), gross=0.1, gaps=1.0)
    px, sigma_px = seen.px[1].copy(), seen.sigma_px[1].copy()
    px[0, :, :, 3] += 300.0
    px[1, 0, :, 4] = 1e6
    sigma_px[1, 1, :, 5] = -1.0
    px[2, 2:, :, :4] = np.nan
    px[3, 1:, :, 2] = np.nan
    for c, eye_m in enumerate(EYES_M):
        behind = 2 * eye_m - np.array([0.2, 0.0, 1.0])
        at = np.einsum("cij,j->ci", RIG[:, :, :3], behind) + RIG[:, :, 3]
        px[4, :, 0, 6 + c] = at[:, :2] / at[:, 2:]
    values: Values = {}
    for gate in (0.0, 5.0, 2.0):
        made = doors.triangulate_views(RIG, px, sigma_px, gate)
        factor = np.full((*made["cov_world"].shape[:-2], 6), -1.0)
        is_made = np.isfinite(made["points_world"][..., 0])
        factor[is_made] = np.linalg.cholesky(made["cov_world"][is_made])[:, *np.tril_indices(3)]
        values |= {f"{gate:g}/point_m": made["points_world"], f"{gate:g}/std_m": factor,
                   f"{gate:g}/used": made["used"]}  # fmt: skip
    pairs = np.concatenate(
        [seen.px[1, 0, :2, 0].swapaxes(0, 1), seen.px[1, 1, :2, 0].swapaxes(0, 1)]
    )
    pairs = np.concatenate([np.nan_to_num(pairs, nan=500.0), [[[960, 540], [960, 540]]]])
    lines = doors.lines_of_sight(RIG, pairs)
    parallel = doors.lines_of_sight(RIG[[0, 0]], np.array([[[960.0, 540], [1000, 540]]]))
    rng = np.random.default_rng(9)
    costs = [
        rng.normal(size=shape) for shape in ((1, 1), (2, 2), (3, 3), (2, 5), (4, 4), (5, 6), (3, 1))
    ]
    columns = [doors.assign(cost if cost.shape[1] > 1 else cost[:1]) for cost in costs]
    values |= {**lines, "parallel": np.nan_to_num(parallel["passing"], posinf=1e9)}
    values["columns"] = np.concatenate(columns)
    quaternions = rng.normal(size=(6, 4))
    quaternions /= np.linalg.norm(quaternions, axis=-1, keepdims=True)
    values |= doors.rotations(np.linspace(-4, 4, 9), quaternions, np.array([0.3, -0.8, 1.7]))
    return Played(_shrunk(values))


def meet_planes(_: Values) -> Played:
    """Play points of the planes of some views, also of points behind one of the cameras."""
    rng, n = np.random.default_rng(10), 200
    points_m = rng.normal([0.0, 0.0, 1.0], 1.5, (n, 3))
    points_m[::2] = EYES_M[np.arange(n // 2) % 4] * rng.uniform(1.01, 2.0, (n // 2, 1))
    at = np.einsum("cij,nj->nci", RIG[:, :, :3], points_m) + RIG[:, :, 3]
    px = at[..., :2] / at[..., 2:] + rng.normal(0, 2.0, (n, 4, 2))
    found_m, are_found = doors.meet_planes(RIG, px, rng.random((n, 4)) < 0.7)
    return Played({"points_m": np.where(are_found[:, None], found_m, 0.0), "found": are_found})


def meet_nearly_parallel(_: Values) -> Played:
    """Play points of two or three cameras that nearly are in the same place."""
    rng, n = np.random.default_rng(11), 400
    baselines_m = np.geomspace(1e-8, 3e-1, n)
    found, made = [], []
    for k in range(n):
        n_cameras = 2 + k % 2
        P = np.repeat(RIG[:1], n_cameras, axis=0)
        P[1:, :, 3] += P[1:, :, :3] @ rng.normal(0, baselines_m[k], 3)
        point_m = rng.normal([0.0, 0.0, 1.0], 0.5)
        at = np.einsum("cij,j->ci", P[:, :, :3], point_m) + P[:, :, 3]
        px = at[:, :2] / at[:, 2:]
        found.append(doors.meet_planes(P, px[None], np.ones((1, n_cameras), bool))[1])
        views = px[None, :, None, None], np.full((1, n_cameras, 1, 1), 2.0)
        made.append(np.isfinite(doors.triangulate_views(P, *views, 0.0)["points_world"]).all())
    return Played({"found": np.concatenate(found), "made": np.array(made)})


LIMBS = (((0,), (0,)), ((1, 2), (7, 8)), ((1,), (2,)), ((7,), (8,)), ((1,), (3,)), ((2,), (4,)),
         ((3,), (5,)), ((4,), (6,)), ((7,), (9,)), ((8,), (10,)), ((9,), (11,)), ((10,), (12,)),
         ((11,), (13,)), ((12,), (14,)))  # fmt: skip
"""Joints between whose means the limbs of a body of sticks run; hands follow forearms by 18 cm."""


def make_limbs(joints_world: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return capsules (..., 16, 2, 3) of bodies of sticks with joints (..., 15, 3)."""
    ends = [[joints_world[..., end, :].mean(-2) for end in limb] for limb in LIMBS]
    for elbow, wrist in ((3, 5), (4, 6)):
        end = joints_world[..., wrist, :]
        forearm = end - joints_world[..., elbow, :]
        length_m = np.maximum(np.sqrt((forearm**2).sum(-1, keepdims=True)), 1e-6)
        ends.append([end, end + 0.18 / length_m * forearm])
    return np.stack([np.stack(limb, -2) for limb in ends], -3)


def move_chains(_: Values) -> Played:
    """Play a robot of hinges and slides, and how far capsules of all kinds are apart."""
    rng = np.random.default_rng(10)
    frames = np.tile(np.eye(4), (9, 1, 1))
    for frame in frames:
        frame[:3, :3] = _rotation(tuple(rng.uniform(-2, 2, 3)))
        frame[:3, 3] = rng.uniform(-0.5, 0.5, 3)
    slides = np.array([True, False, False, True, False, False, False])
    chain = doors.Chain(
        base=frames[0], joints=frames[1:8], tool=frames[8], ranges=np.tile([-3.0, 3.0], (7, 1)),
        speeds=np.full(7, 2.0), slides=slides, capsule_link=np.array([0, 1, 3, 4, 6]),
        capsule_ends=rng.uniform(-0.4, 0.4, (5, 2, 3)), capsule_radius_m=rng.uniform(0.03, 0.1, 5),
    )  # fmt: skip
    path, qd = rng.uniform(-2, 2, (6, 3, 7)), rng.uniform(-1, 1, (6, 7))
    values = {f"pose/{name}": each for name, each in chain.pose(path[:, 0]).items()}
    values |= {f"path/{name}": each for name, each in chain.follow(path, qd).items()}
    body = make_limbs(_walkers(4)[::3, :3].reshape(6, 1, N_JOINTS, 3))
    robot = chain.pose(path[:, 0])["capsules"]
    thick = rng.uniform(0.03, 0.2, body.shape[2])
    gaps = doors.separate(robot, rng.uniform(0.03, 0.1, 5), body, thick)
    few = doors.separate(robot[:, :1], np.full(1, 0.1), body[:, 0], np.tile(thick, (6, 1)))
    segments = rng.uniform(-1, 1, (80, 4, 3))
    segments[10:20, 3] = segments[10:20, 2]
    segments[20:30, 1] = segments[20:30, 0]
    segments[30:34, 1], segments[30:34, 3] = segments[30:34, 0], segments[30:34, 2]
    segments[34:44, 3] = segments[34:44, 2] + 0.7 * (segments[34:44, 1] - segments[34:44, 0])
    values |= {f"gap/{name}": each for name, each in gaps.items()}
    values |= {f"few/{name}": each for name, each in few.items()}
    values |= {"segments": body, "closest": doors.closest_on_segments(segments)}
    return Played(_shrunk(values))


def hide_points(_: Values) -> Played:
    """Play lines through shapes of all kinds, and what these, robots and bodies hide."""
    rng = np.random.default_rng(11)
    kinds = [
        "box",
        "plane",
        "cylinder",
        "capsule",
        "capsule",
        "plane",
        "box",
        "cylinder",
        "capsule",
    ]
    n = len(kinds)
    axes = np.stack([_rotation(tuple(rng.uniform(-2, 2, 3))) for _ in kinds])
    axes[0] = np.eye(3)
    half = rng.uniform(0.1, 0.5, (n, 3))
    half[4, 1], half[5, 0] = 0.0, np.inf
    half[[2, 3, 4, 7, 8], 2] = 0.0
    shapes = doors.Shapes(
        kinds, rng.uniform([-1.2, -1.2, 0.3], [1.2, 1.2, 1.8], (n, 3)), axes, half
    )
    eyes = rng.uniform(-3, 3, (160, 3))
    eyes[:30] = rng.uniform([-1, -1, 0.4], [1, 1, 1.6], (30, 3))
    d = rng.uniform([-1, -1, 0.3], [1, 1, 1.8], (160, 3)) - eyes
    d[150:] = [[0.0, 0.0, 1.0]] * 5 + [[1.0, 0.0, 0.0]] * 5
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    passages = np.clip(shapes.passages(eyes, d), -50.0, 50.0)
    far = doors.Shapes(kinds[2:5], rng.uniform(-1, 1, (3, 3)), axes[2:5], half[2:5])
    aligned = np.repeat(axes[2:5, :, 2], 3, 0)
    along = np.clip(far.passages(np.zeros((9, 3)) + rng.uniform(-1, 1, (9, 1)), aligned), -50, 50)
    people = np.stack([walk(seed, 24, 0.3)[::3] for seed in (1, 2, 3, 4)], 1)
    points = people.reshape(-1, N_JOINTS, 3)
    robot = rng.uniform([-1, -1, 0], [1, 1, 1.5], (len(points), 4, 2, 3))
    hidden = shapes.hide(EYES_M, points, robot, rng.uniform(0.05, 0.15, 4), 2)
    bodies = make_limbs(people)
    radius_m = np.tile(rng.uniform(0.05, 0.16, bodies.shape[2]), 4)
    behind = [
        shapes.hide_behind_bodies(eye, people[t, k], bodies[t].reshape(-1, 2, 3), radius_m)
        for t in range(len(people)) for k in range(4) for eye in EYES_M
    ]  # fmt: skip
    corners = doors.Shapes(["box", "capsule", "box"], eyes[:3], axes[:3], half[:3]).bounds()
    return Played({
        "passages_m": passages, "along_m": along, "hidden": hidden,
        "behind": np.array([each for each, _ in behind]), "bounds_m": corners,
        "in_view": np.array([count for _, count in behind]),
    })  # fmt: skip


def begin_clouds(_: Values) -> Played:
    """Play where the paper's clouds begin: cameras round the place, in a line, nearly so, alone."""
    rng, beliefs = np.random.default_rng(17), []
    for k in range(24):
        lengths_m = np.array(
            [(0.9, 4.0), (1.1, 4.0), (5.0, 0.3), (5.0, 1.7), (0.0, 0.0), (3.0, 2.0)][k % 6]
        )
        share = np.sort(rng.random((2 + k % 3, 2)), axis=0)
        share[0], share[-1] = 0.0, 1.0
        eyes_m = np.array([2.4, -0.6]) * rng.choice([-1.0, 1.0], 2) + share * lengths_m
        eyes = np.column_stack([rng.permuted(eyes_m, axis=0), rng.uniform(2.0, 2.6, len(eyes_m))])
        P = np.stack([hang_camera(eye) for eye in eyes])[: 1 if k == 22 else None]
        settings = {"n_particles": 40} | BEGUN[k % len(BEGUN)]
        tracker = doors.Tracker("paper", P, STEP_S, (2, 1), settings, seed=k)
        beliefs.append(_means_of_joints(tracker.estimate()))
    return Played({name: each[:, :, 0] for name, each in stack(beliefs).items()})


BEGUN: tuple[dict[str, Any], ...] = (
    {}, {"prior_std_m": 0.3}, {"prior_mean_world": (0.5, 0.7, 1.2), "prior_std_m": 0.8}, {},
    {"place_m": ((-1.0, 1.5), (-2.0, 2.0), (0.1, 2.0))},
)  # fmt: skip
"""Settings with which clouds begin."""


def find_ways(_: Values) -> Played:
    """Play ways on floors among footprints, rays along them, and capsules that meet them."""
    rng = np.random.default_rng(12)
    footprints = np.column_stack([rng.uniform(-1.5, 1.5, (5, 2)), rng.uniform(0.1, 0.6, (5, 2)),
                                  rng.uniform(-3, 3, 5)])  # fmt: skip
    xs, ys = np.arange(-2, 2.01, 0.2), np.arange(-1.6, 1.61, 0.2)
    places, angles = rng.uniform(-2.4, 2.4, (20, 2)), np.linspace(0, 6, 8)
    values = doors.floor_ways(xs, ys, footprints, places, angles, (1.7, -1.3))
    capsules = rng.uniform(-2, 2, (150, 2, 2, 3))
    capsules[..., 1, :] = capsules[..., 0, :] + rng.uniform(-0.5, 0.5, (150, 2, 3))
    values["met"] = doors.meet_footprints(capsules, np.array([0.02, 0.12]), footprints[:3])
    values["kept"] = doors.keep_apart(places, 0.8)
    values["none_m"] = doors.floor_ways(xs, ys, footprints[:1], places, angles, (0.0, 0.0))[
        "ways_m"
    ]
    return Played(values)


BESIDE: tuple[Probe, ...] = (
    Probe(name="planes", play=meet_planes, is_short=True),
    Probe(name="clouds_begun", play=begin_clouds, is_short=True),
    Probe(name="nearly_parallel", play=meet_nearly_parallel, is_short=True),
    Probe(name="smoother", play=smooth, is_short=True),
    Probe(name="poses_assigned", play=partial(assign_poses, 4), is_short=True),
    Probe(name="poses_of_one_camera", play=partial(assign_poses, 1), is_short=True),
    Probe(name="poses_of_two_cameras", play=partial(assign_poses, 2), is_short=True),
    Probe(name="presence_images", play=partial(look_for_people, False), is_short=True),
    Probe(name="presence_searches", play=partial(look_for_people, True)),
    Probe(name="presence_floor", play=look_over_floor, is_short=True),
    Probe(name="unexplained", play=explain_people, is_short=True),
    Probe(name="watched_cameras", play=watch_cameras, is_short=True),
    Probe(name="without_cameras", play=believe_without_cameras, is_short=True),
    Probe(name="lenses", play=look_through_lenses, is_short=True),
    Probe(name="triangulation_of_views", play=triangulate, is_short=True),
    Probe(name="chains", play=move_chains, is_short=True),
    Probe(name="hidden_points", play=hide_points, is_short=True),
    Probe(name="ways", play=find_ways, is_short=True),
)


def _probes() -> Iterator[Probe]:
    for estimator in ESTIMATORS:
        kinds = dict(KINDS)
        if estimator in ("particle", "kalman"):
            kinds |= TREES
        if estimator.startswith("paper"):
            kinds |= CLOUDS
        for name, kind in kinds.items():
            short = kind.is_short or (estimator == "particle" and name in SHORT)
            play = partial(follow, estimator, kind)
            yield Probe(name=f"{estimator}_{name}", play=play, is_short=short)


SHORT = ("one_limb", "one_view_start", "askew", "mirrored_body", "jumping")
"""Of the default estimator, in the short form besides."""
PROBES: tuple[Probe, ...] = (*_probes(), *BESIDE)
