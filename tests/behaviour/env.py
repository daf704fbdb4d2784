"""Episodes with recorded actions: whole ones of every id, and a set that covers the settings.

An expert plays when a probe is recorded for the first time; afterwards its actions are replayed,
so that rounding is not fed back through an agent. Until the first contact, and until a track is
lost, everything is compared; afterwards only what has happened so far (goals, contacts by kind,
cost, return).
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from tests.behaviour import doors
from tests.behaviour.probe import Played, Probe, Values, stack

EVERY = 10
"""Every so many steps everything is recorded; rewards and costs are summed up in between."""
SUMMED = ("reward", "cost")
"""Names of what is summed up begin so."""
EVENTS = (
    "return", "episode_cost", "task/", "is_success", "safety/contacts_", "safety/near_misses",
    "terminated", "truncated",
)  # fmt: skip
"""Names begin so of what counts after the first contact, too."""
TOUCHED = "cost_contact"
TRACKED = "observation/worker_tracked"
PIXEL_TOLERANCE = 0.05
"""Largest difference that another renderer may make to estimates."""
NOISE, RUSH = "noise", "rush"
"""Agents that look at nothing: another action at every step; full speed one way for a while."""
RUSHES_FOR = 40
"""Steps."""
RELEASING = "releasing"
"""Said after an agent's name: from half of the episode on its hand is opened."""
SEED = 49
ALONG = (0.6, 0.0, 0.8)
"""A direction."""
REACH, PICK, HAND = "HRCReach-v0", "HRCPickPlace-v0", "HRCHandover-v0"
DRYWALL, DELIVERY = "HRCDrywall-v0", "HRCDelivery-v0"
REACH_GOAL, PICK_GOAL = "HRCReachGoal-v0", "HRCPickPlaceGoal-v0"


def play(env_id: str, seed: int, options: Mapping[str, Any], inputs: Values) -> Played:
    """Play an episode with recorded actions."""
    env = doors.Env(env_id, **options)
    moments = [env.reset(seed)]
    for action in inputs["actions"]:
        moment, is_over = env.step(action)
        moments.append(moment)
        if is_over:
            break
    env.close()
    return summarize(moments)


def play_again(env_id: str, seed: int, options: Mapping[str, Any], inputs: Values) -> Played:
    """Play half an episode, then its second half twice: the state is saved and brought back."""
    env = doors.Env(env_id, **options)
    env.reset(seed)
    actions = inputs["actions"]
    half = len(actions) // 2
    for action in actions[:half]:
        env.step(action)
    saved = env.save()
    halves = []
    for _ in range(2):
        halves.append(summarize([env.step(action)[0] for action in actions[half:]]))
        env.restore(saved)
    env.close()
    first, second = halves
    names = {f"again/{name}": value for name, value in second.values.items()}
    return Played(first.values | names, first.n_settled, first.events)


def play_episodes(env_id: str, seed: int, options: Mapping[str, Any], inputs: Values) -> Played:
    """Play the beginnings of some episodes in one environment, only the first of them seeded."""
    env = doors.Env(env_id, **options)
    moments = []
    for k, actions in enumerate(np.array_split(inputs["actions"], 3)):
        moments.append(env.reset(seed if k == 0 else None))
        moments.extend(env.step(action)[0] for action in actions)
    env.close()
    return summarize(moments)


N_BATCH = 3


def play_batch(
    env_id: str, seed: int, n_steps: int, options: Mapping[str, Any], inputs: Values
) -> Played:
    """Play environments that are stepped at once; `n_steps` is how long episodes may last."""
    env = doors.Batch(env_id, N_BATCH, n_steps, **options)
    moments = [env.reset(seed), *(env.step(actions) for actions in inputs["actions"])]
    env.close()
    names = dict.fromkeys(name for moment in moments for name in moment)
    absent = {name: np.full_like(moments[1][name], 0) for name in names if name in moments[1]}
    values = stack([{name: moment.get(name, absent.get(name)) for name in absent}
                    for moment in moments])  # fmt: skip
    kept = np.append(np.arange(0, len(moments) - 1, EVERY), len(moments) - 1)
    starts = np.append(0, kept[:-1] + 1)
    short = {name: value[kept] for name, value in values.items()}
    touched = values[TOUCHED].any(axis=1)
    n_settled = int(np.searchsorted(kept, np.argmax(touched))) if touched.any() else None
    return Played(short | _blend(values, starts, kept + 1), n_settled)


def record_batch(
    env_id: str, seed: int, n_steps: int, options: Mapping[str, Any], n_moments: int, agent: str
) -> Values:
    """Return the actions of an agent in environments that are stepped at once."""
    env = doors.Batch(env_id, N_BATCH, n_steps, **options)
    observation, rng, actions = env.reset(seed)["observation/all"], np.random.default_rng(seed), []
    agents = [] if agent == NOISE else env.make_agents(agent)
    for _ in range(n_moments):
        action = rng.uniform(-1, 1, env.action_shape).astype(np.float32)
        for row, act in enumerate(agents):
            action[row] = act(observation[row])
        actions.append(action)
        observation = env.step(action)["observation/all"]
    env.close()
    return {"actions": np.array(actions)}


def record_actions(
    env_id: str, seed: int, agent: str, n_steps: int, options: Mapping[str, Any]
) -> Values:
    """Return the actions of an agent in one episode."""
    env = doors.Env(env_id, **options)
    env.reset(seed)
    if agent in (NOISE, RUSH):
        env.close()
        rng, shape = np.random.default_rng(seed), (n_steps, env.action_size)
        whole = rng.choice([-1.0, 1.0], shape)[np.arange(n_steps) // RUSHES_FOR]
        actions = rng.uniform(-1, 1, shape) if agent == NOISE else whole
        return {"actions": actions.astype(np.float32)}
    name, _, manner = agent.partition(" ")
    act, actions = env.make_agent(name), []
    for k in range(n_steps):
        action = np.array(act(env.observation), np.float32)
        if manner == RELEASING and k >= n_steps // 2:
            action[-1] = -1.0
        actions.append(action)
        if env.step(action)[1]:
            break
    env.close()
    return {"actions": np.array(actions)}


def summarize(moments: Sequence[Mapping[str, Any]]) -> Played:
    """Return an episode's values at every few steps."""
    names = dict.fromkeys(name for moment in moments for name in moment)
    filled = [{name: _plain(moment.get(name)) for name in names} for moment in moments]
    values = stack(_same_kinds(filled))
    kept = np.append(np.arange(0, len(moments) - 1, EVERY), len(moments) - 1)
    starts = np.append(0, kept[:-1] + 1)
    short: Values = {}
    for name, value in values.items():
        if name.startswith(SUMMED):
            short[name] = np.add.reduceat(np.nan_to_num(value.astype(float)), starts)
        elif value.dtype.kind == "U":
            parts = zip(starts, kept + 1, strict=True)
            short[name] = np.array([" ".join(dict.fromkeys(value[a:b])) for a, b in parts])
        else:
            short[name] = value[kept]
    short["return"] = np.cumsum(short["reward"])
    short |= _blend(values, starts, kept + 1)
    events = frozenset(name for name in short if name.startswith(EVENTS))
    return Played(short, _count_settled(values, kept), events)


def _blend(values: Values, starts: np.ndarray, ends: np.ndarray) -> Values:
    """Return two sums with unlike weights of all numbers in the steps from each start to its end:
    of observations and of the rest. Numbers above 1 count by their logarithm, as they are compared
    relative to their size, and the sums are as exact as one number."""
    blended: Values = {}
    for kind, is_observed in (("observation", True), ("rest", False)):
        chosen = [
            np.nan_to_num(value.astype(float).reshape(len(value), -1), nan=3.0, posinf=5.0)
            for name, value in values.items()
            if value.dtype.kind in "fiub" and name.startswith("observation/") == is_observed
        ]
        numbers = np.concatenate(chosen, axis=1)
        numbers = np.sign(numbers) * np.log1p(np.abs(numbers))
        parts = [numbers[a:b].ravel() for a, b in zip(starts, ends, strict=True)]
        blended[f"every step/{kind}"] = np.array(
            [part @ np.cos(1.0 + np.arange(len(part)) ** 1.3) / len(part) ** 0.5 for part in parts]
        )
    return blended


def _count_settled(values: Values, kept: np.ndarray) -> int | None:
    """Count the kept moments before the first contact or the first loss of a track."""
    ends = values.get(TOUCHED, np.zeros(len(values[TRACKED]))) > 0
    tracked = values[TRACKED].reshape(len(ends), -1)
    ends[1:] |= (tracked[1:] < tracked[:-1]).any(axis=1)
    return int(np.searchsorted(kept, np.argmax(ends))) if ends.any() else None


def _plain(value: Any) -> Any:
    """Return a value as an array of numbers, or words as one string; None: not there."""
    if isinstance(value, tuple | list):
        return ",".join(map(str, value))
    return value


def _same_kinds(moments: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Put "" or NaN where a moment lacks a value that others have."""
    for name in moments[0]:
        known = next((m[name] for m in moments if m[name] is not None), 0.0)
        absent = "" if isinstance(known, str) else np.full(np.shape(known), np.nan)
        for moment in moments:
            if moment[name] is None:
                moment[name] = absent
    return moments


def play_bounds(env_id: str, options: Mapping[str, Any], inputs: Values) -> Played:
    """Return an environment's spaces and time limit."""
    env = doors.Env(env_id, **options)
    values = {name: value[None] for name, value in env.bounds().items()}
    env.close()
    return Played(values)


def play_scene(env_id: str, options: Mapping[str, Any], inputs: Values) -> Played:
    """Return the numbers of a compiled scene."""
    env = doors.Env(env_id, **options)
    values = env.describe_scene()
    env.close()
    return Played({name: value for name, value in values.items() if len(value)})


def play_model(env_id: str, options: Mapping[str, Any], inputs: Values) -> Played:
    """Return what shields know of a robot that is commanded in some way."""
    env = doors.Env(env_id, **options)
    values = env.describe_model()
    env.close()
    return Played(values)


def play_contacts(env_id: str, options: Mapping[str, Any], inputs: Values) -> Played:
    """Return which bodies of a compiled scene may touch, how they look, and how it is solved."""
    env = doors.Env(env_id, **options)
    values = env.describe_contacts()
    env.close()
    return Played({name: value for name, value in values.items() if len(value)})


def play_rig(env_id: str, options: Mapping[str, Any], inputs: Values) -> Played:
    """Return what the cameras of a scene see of the places where people are."""
    env = doors.Env(env_id, **options)
    values = env.describe_rig()
    env.close()
    return Played(values)


def play_pictures(env_id: str, options: Mapping[str, Any], inputs: Values) -> Played:
    """Return the means over tiles of what is drawn for people, of three moments."""
    env = doors.Env(env_id, render_mode="rgb_array", **options)
    env.reset(SEED)
    views, mosaics = [], []
    for action in inputs["actions"]:
        env.step(action)
        views.append(_tile(env.view()))
        mosaics.append(_tile(env.picture()))
    env.close()
    return Played({"view": np.array(views), "mosaic": np.array(mosaics)})


def _tile(image: np.ndarray, n: int = 24) -> np.ndarray:
    """Return the mean colour of n x n tiles of an image, in [0, 1]."""
    height, width = (size // n * n for size in image.shape[:2])
    tiles = image[:height, :width].reshape(n, height // n, n, width // n, -1)
    return tiles.mean(axis=(1, 3)) / 255.0


def play_judged(env_id: str, inputs: Values) -> Played:
    """Return the rewards of pairs of goals."""
    env = doors.Env(env_id, perception="keypoints")
    values = {"reward": env.judge_goals(inputs["achieved"], inputs["desired"])}
    env.close()
    return Played(values)


def compare_tracks(_: Values) -> Played:
    """Return the errors of tracks of three workers who cross, leave and are taken for others."""
    rng, n = np.random.default_rng(SEED), 120
    t = np.linspace(-1, 1, n)[:, None, None, None]
    ways = np.array([[1.5, 0, 0], [-1.5, 0.2, 0], [0.1, 1.2, 0]])[:, None]
    joints = ways * t + rng.normal(0, 0.3, (3, len(doors.JOINTS), 3)) + [0, 0, 1]
    means = joints + rng.normal(0, 0.05, joints.shape)
    means[50:80, [0, 1]] = means[50:80, [1, 0]]  # exchanged, then found again
    means[90:, 2] += rng.uniform(0.3, 0.9, (n - 90, 1, 1))  # lost bit by bit
    tracked, present = rng.random((n, 3)) < 0.95, np.ones((n, 3), bool)
    present[:15, 2] = present[100:, 0] = False
    return Played(doors.compare_tracks(means, joints, tracked, present))


def mistake_tracks(_: Values) -> Played:
    """Return the errors of tracks that are of anybody in a crowd, in many short episodes."""
    rng, kept = np.random.default_rng(SEED), []
    for n_workers in (1, 2, 3, 4) * 10:
        at = rng.uniform(-0.6, 0.6, (1, n_workers, 1, 3)) * [1, 1, 0]
        walks = at + np.cumsum(rng.normal(0, 0.08, (10, n_workers, 1, 3)), axis=0)
        joints = walks + rng.normal(0, 0.2, (n_workers, len(doors.JOINTS), 3))
        order = np.array([rng.permutation(n_workers) for _ in range(3)])[np.arange(10) // 4]
        means = np.take_along_axis(joints, order[:, :, None, None], axis=1)
        means = means + rng.normal(0, 0.25, (10, n_workers, 1, 3))
        tracked, present = rng.random((2, 10, n_workers)) < 0.85
        kept.append(doors.compare_tracks(means, joints, tracked, present))
    return Played({name: np.concatenate([each[name] for each in kept]) for name in kept[0]})


def name_settings() -> Values:
    """Return the names of all settings that there are today."""
    return {"names": np.array(list(doors.settings()))}


def describe_settings(inputs: Values) -> Played:
    """Return the defaults of the settings that there were; others may have come."""
    defaults = doors.settings()
    return Played(
        {"defaults": np.array([f"{name} = {defaults[name]}" for name in inputs["names"]])}
    )


def describe_presets(_: Values) -> Played:
    """Return the numbers that stand behind names of appearances and makes of cameras."""
    return Played(doors.presets())


def dress_scene(env_id: str, options: Mapping[str, Any], _: Values) -> Played:
    """Return how episodes of every kind of appearance look: light, colours, hats, litter."""
    env, values = doors.Env(env_id, perception="none", **options), Values()
    for name in doors.APPEARANCE_NAMES:
        looks = [env.dress(name, seed) for seed in range(5)]
        values |= {f"{name}/{key}": value for key, value in stack(looks).items()}
    env.close()
    return Played({name: value for name, value in values.items() if value.size})


def list_spots(_: Values) -> Played:
    """Return where tasks have the tool get to, whatever their settings."""
    values: Values = {}
    for env_id in (REACH, PICK, DRYWALL, HAND, DELIVERY):
        values[env_id] = doors.spots_of(env_id, {})
    turned = {"azimuth_rad": (0.2, 1.3), "distance_m": (0.4, 0.7), "height_m": (0.5, 1.4)}
    values["turned"] = doors.spots_of(REACH, turned)
    return Played({name: value for name, value in values.items() if len(value)})


def measure_reach(_: Values) -> Played:
    """Return how far every robot gets in some directions, by bisection [m]."""
    rng, values = np.random.default_rng(SEED), Values()
    ways = rng.normal(0, 1, (6, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    for robot in doors.ROBOT_NAMES:
        found = []
        for way in ways:
            for along, within_m in ((None, 0.0), (None, 0.2), (tuple(-way), 0.0), (ALONG, 0.1)):
                near_m, far_m = 0.0, 50.0
                for _halving in range(44):
                    middle_m = (near_m + far_m) / 2
                    can = doors.can_reach(robot, middle_m * way, along, within_m)
                    near_m, far_m = (middle_m, far_m) if can else (near_m, middle_m)
                found.append(near_m)
        values[robot] = np.array(found)
    return Played(values)


def take_in_hand(env_id: str, _: Values) -> Played:
    """Return what a hand holds at points in and beside turned objects."""
    rng, n = np.random.default_rng(SEED), 400
    turns = rng.normal(size=(n, 4))
    places = rng.uniform(-1, 1, (n, 3))
    poses = np.hstack([places, turns / np.linalg.norm(turns, axis=1, keepdims=True)])
    points_m = places + rng.normal(0, 1, (n, 3)) * np.geomspace(0.003, 0.3, n)[:, None]
    return Played({"held": doors.objects_in_hand(env_id, poses, points_m)})


def draw_goals(env_id: str) -> Values:
    """Return pairs of goals from equal to far apart."""
    env = doors.Env(env_id, perception="keypoints")
    env.reset(SEED)
    size = len(env.observation["achieved_goal"])
    env.close()
    rng = np.random.default_rng(SEED)
    desired = rng.uniform(-1, 1, (40, size))
    off_m = rng.normal(0, 1, (40, size)) * np.geomspace(1e-3, 1.0, 40)[:, None]
    return {"achieved": (desired + off_m).astype(np.float32), "desired": desired.astype(np.float32)}


def _make(
    name: str,
    env_id: str,
    n_steps: int,
    agent: str = "scripted",
    seed: int = SEED,
    is_short: bool = False,
    play: Callable[[str, int, Mapping[str, Any], Values], Played] = play,
    **options: Any,
) -> Probe:
    options = {"perception": "keypoints", **options}
    has_pixels = options["perception"] == "pixels"
    return Probe(
        name=name,
        play=partial(play, env_id, seed, options),
        inputs=partial(record_actions, env_id, seed, agent, n_steps, options),
        subject=env_id,
        is_short=is_short,
        needs_pixels=has_pixels,
        tolerance=PIXEL_TOLERANCE if has_pixels else 1e-6,
    )


def _fault(kind: str, amount: float | None = None, camera: Any = "all", **when: float) -> Any:
    fault = {"kind": kind, "cameras": (camera,), **when}
    return [fault if amount is None else {**fault, "amount": amount}]


LATE = [
    {"name": f"camera_{k}", "eye_m": eye, "latency_s": late_s, "rate_hz": rate_hz}
    for k, (eye, late_s, rate_hz) in enumerate((
        ((2.9, 2.6, 2.45), 0.12, 0.0), ((2.9, -2.6, 2.45), 0.2, 12.5),
        ((-2.6, 2.6, 2.45), 0.0, 5.0), ((-2.6, -2.6, 2.45), 0.08, 0.0),
    ))
]  # fmt: skip
"""A rig whose images are late and say so."""
IMAGE_FAULTS = [
    {"kind": kind, "cameras": (k % 4,), "amount": amount}
    for k, (kind, amount) in enumerate((
        ("motion_blur", 0.04), ("defocus", 6.0), ("noise", 15.0), ("dirt", 0.1),
        ("white_balance", 0.4), ("exposure", 1.0), ("darkness", 0.1), ("glare", 0.6),
    ))
]  # fmt: skip
"""Two of each camera."""

WHOLE = (
    _make("reach_whole", REACH, 250, seed=200, is_short=True),
    _make("reach_touched", REACH, 250, seed=204),
    _make("pick_place_whole", PICK, 750, is_short=True),
    _make("handover_whole", HAND, 750, is_short=True),
    _make("drywall_whole", DRYWALL, 1000, is_short=True),
    _make("delivery_whole", DELIVERY, 1000, is_short=True),
    _make("reach_goal_whole", REACH_GOAL, 100, seed=202, is_short=True),
    _make("pick_place_goal_whole", PICK_GOAL, 750),
)
COVERING = (
    # levels of perception, estimators, cameras
    _make("reach_truth", REACH, 150, perception="truth"),
    _make("reach_none", REACH, 100, "scripted_slowed", perception="none"),
    _make("reach_kalman_one_camera", REACH, 200, seed=50, estimator="kalman", kept_cameras=[1]),
    _make("reach_one_camera", REACH, 200, seed=51, kept_cameras=[2], shield="qp", is_short=True),
    _make("pick_two_cameras", PICK, 150, seed=52, kept_cameras=[0, 3]),
    _make("reach_triangulation", REACH, 150, seed=53, estimator="triangulation"),
    _make("reach_ransac", REACH, 150, seed=54, estimator="ransac"),
    _make("reach_paper_restarts", REACH, 60, seed=55, estimator="paper_restarts"),
    _make("reach_paper", REACH, 20, seed=55, estimator="paper"),
    # late and faulty images
    _make("reach_late_known", REACH, 200, seed=56, cameras=LATE, shield="ssm"),
    _make("reach_late_unknown", REACH, 150, seed=57, faults=_fault("out_of_step", 3.0)),
    _make("hand_late_fault", HAND, 150, seed=58, faults=_fault("late", 0.16)),
    _make("reach_dropped", REACH, 150, seed=59, faults=_fault("dropped", 0.5)),
    _make("reach_frozen", REACH, 150, seed=60,
          faults=_fault("frozen", camera="camera_1", from_s=2.0)),
    _make(
        "reach_blind", REACH, 220, seed=61, shield="qp", is_short=True,
        faults=_fault("lost", from_s=3.0, until_s=6.0),
    ),
    _make("reach_turned", REACH, 250, seed=62, faults=_fault("wrong_rotation", 0.05, "camera_2")),
    _make("reach_moved", REACH, 150, seed=63, faults=_fault("wrong_translation", 0.1, "camera_3")),
    _make("reach_focal", REACH, 150, seed=64, faults=_fault("wrong_focal", 0.05)),
    _make(
        "drywall_knocked", DRYWALL, 150, seed=65,
        faults=_fault("knocked", 0.1, "camera_4", from_s=2.0),
    ),
    # workers
    _make("reach_two_workers", REACH, 200, seed=66, n_workers=2, shield="qp", is_short=True),
    _make("pick_some_workers", PICK, 150, seed=67, n_workers=(0, 3), bodies="any"),
    _make("reach_hurried", REACH, 250, seed=68, people="hurried"),
    _make("reach_unaware", REACH, 250, seed=69, people="unaware", bodies=("worker_2", "worker_3")),
    _make("site_headlong", REACH, 250, "scripted_slowed", seed=70, scene="site",
          people="headlong", n_workers=2),
    _make("reach_low_work", REACH, 250, seed=71, jobs="low_work", cost_components=(
        "proximity", "contact", "towards", "force", "too_near", "near_miss")),
    _make("handover_attentive_slowed", HAND, 300, "scripted_slowed", seed=72),
    _make("reach_nobody", REACH, 60, seed=73, n_workers=0, shield="qp"),
    # shields
    _make("reach_qp_unaware", REACH, 250, seed=74, shield="qp", people="unaware",
          observes_shield=True),
    _make("reach_ssm", REACH, 150, seed=75, shield="ssm", jobs="low_work"),
    _make("hand_pfl", HAND, 300, seed=76, shield="pfl", is_short=True),
    _make("delivery_qp", DELIVERY, 300, seed=77, shield="qp", n_workers=3),
    _make("drywall_qp", DRYWALL, 400, seed=78, shield="qp"),
    # scenes, control, robots, observations, endings
    _make("drywall_site", DRYWALL, 150, seed=79, scene="site"),
    _make("delivery_unaware", DELIVERY, 500, seed=80, people="unaware", n_workers=4),
    _make("delivery_careless", DELIVERY, 600, seed=95, people="headlong", n_workers=(2, 6),
          bodies="any"),
    _make("pick_dropped", PICK, 260, "scripted releasing", seed=96),
    _make("hand_dropped", HAND, 500, "scripted releasing", seed=97, people="hurried"),
    _make("drywall_dropped", DRYWALL, 700, "scripted releasing", seed=98),
    _make("drywall_slowed", DRYWALL, 800, "scripted_slowed", seed=99, people="hurried"),
    _make("pick_goal_all", PICK_GOAL, 200, seed=100, reward_kind="all"),
    _make("reach_goal_tool", REACH_GOAL, 100, seed=101, control="tool"),
    _make("reach_tool", REACH, 150, seed=81, control="tool"),
    _make("pick_twist", PICK, 100, "noise", seed=82, control="twist"),
    _make("reach_gripper", REACH, 150, "noise", seed=83, robot="ur10e_gripper"),
    _make("reach_contact_ends", REACH, 250, seed=84, people="unaware", ends_on_contact=True,
          jobs="low_work", cost_below_m=0.25),
    _make("reach_forecast", REACH, 80, seed=85, forecast_s=(0.2, 0.6),
          covariance_terms=("towards_robot", "factor"), is_short=True),
    _make("pick_sparse", PICK, 300, seed=86, reward_kind="sparse", object_noise_m=0.004),
    _make("reach_noise", REACH, 250, "noise", seed=87, step_s=0.08, joint_speed_share=0.8),
    _make("drywall_noise", DRYWALL, 150, "noise", seed=88),
    _make("hand_noise", HAND, 150, "noise", seed=89),
    _make("pick_noise", PICK, 150, "noise", seed=90),
    _make("delivery_noise", DELIVERY, 250, "noise", seed=91),
)  # fmt: skip
MORE = (
    # the same tasks beside other people, under other shields, with other cameras
    _make("reach_headlong", REACH, 250, seed=110, people="headlong", bodies="any", shield="pfl"),
    _make("reach_three_hurried", REACH, 250, "scripted_slowed", seed=111, people="hurried",
          n_workers=3, shield="ssm"),
    _make("reach_triangulation_two", REACH, 150, seed=112, estimator="triangulation", n_workers=2),
    _make("reach_kalman_two", REACH, 200, seed=113, estimator="kalman", n_workers=2,
          kept_cameras=[0, 2]),
    _make("site_pick", PICK, 300, seed=114, scene="site", people="hurried"),
    _make("site_hand", HAND, 400, seed=115, scene="site", people="unaware", shield="ssm"),
    _make("site_drywall", DRYWALL, 500, seed=116, scene="site", people="hurried", shield="pfl",
          n_workers=2),
    _make("pick_unaware_qp", PICK, 500, seed=117, people="unaware", shield="qp", n_workers=2),
    _make("pick_twist_slowed", PICK, 300, "scripted_slowed", seed=118, control="twist"),
    _make("pick_goal_twist", PICK_GOAL, 300, seed=119, control="twist", people="hurried"),
    _make("reach_goal_dense", REACH_GOAL, 100, seed=120, people="unaware",
          shield="qp"),
    _make("hand_twist", HAND, 500, seed=121, control="twist", bodies=("worker_3",)),
    _make("hand_sparse", HAND, 500, seed=122, reward_kind="sparse", object_noise_m=0.01),
    _make("drywall_twist", DRYWALL, 500, seed=123, control="twist", reward_kind="sparse"),
    _make("delivery_blind", DELIVERY, 500, "scripted_slowed", seed=124, people="hurried",
          n_workers=3, shield="ssm", faults=_fault("lost", from_s=5.0, until_s=9.0)),
    _make("delivery_truth", DELIVERY, 700, seed=125, perception="truth", people="unaware",
          n_workers=(1, 5), shield="qp", observes_shield=True),
    _make("reach_costs", REACH, 250, seed=126, people="headlong", jobs="low_work",
          cost_components=("towards", "near_miss"), n_workers=2),
    _make("pick_truth", PICK, 400, seed=127, perception="truth", people="headlong",
          cost_components=("force", "too_near"), forecast_s=(0.4,), covariance_terms=("factor",)),
    _make("reach_slow_frames", REACH, 150, seed=128, faults=_fault("late", 0.2), n_workers=2,
          estimator="kalman"),
    _make("reach_some_noise", REACH, 200, "noise", seed=129, people="unaware", shield="pfl",
          n_workers=2),
    _make("drywall_noise_qp", DRYWALL, 200, "noise", seed=130, people="unaware", shield="qp"),
    _make("hand_noise_unaware", HAND, 250, "noise", seed=131, people="unaware", shield="qp"),
    # other controls under shields
    _make("reach_tool_qp", REACH, 250, seed=144, control="tool", shield="qp", people="unaware"),
    _make("reach_tool_noise", REACH, 250, "noise", seed=145, control="tool", shield="pfl",
          people="hurried", n_workers=2),
    _make("pick_twist_ssm", PICK, 250, seed=146, control="twist", shield="ssm", people="unaware"),
    _make("hand_twist_noise", HAND, 250, "noise", seed=147, control="twist", shield="qp",
          people="unaware", observes_shield=True),
    _make("drywall_twist_pfl", DRYWALL, 300, seed=148, control="twist", shield="pfl",
          people="hurried"),
    # people who are touched
    _make("reach_touched_ends", REACH, 250, seed=151, people="headlong", n_workers=2,
          ends_on_contact=True),
    _make("reach_touched_twice", REACH, 250, seed=153, people="headlong", n_workers=2,
          cost_components=("proximity", "contact", "towards", "force", "too_near", "near_miss")),
    _make("pick_touched", PICK, 640, seed=168, people="headlong", n_workers=3),
    _make("delivery_rush", DELIVERY, 500, RUSH, seed=170, people="headlong", n_workers=6),
    _make("delivery_rush_truth", DELIVERY, 600, RUSH, seed=179, perception="truth",
          people="headlong", n_workers=6, cost_components=("contact", "towards", "force")),
    _make("drywall_rush", DRYWALL, 300, RUSH, seed=180, people="headlong", n_workers=3),
    _make("hand_rush", HAND, 300, RUSH, seed=181, people="headlong", n_workers=2),
    _make("pick_rush", PICK, 300, RUSH, seed=182, people="headlong", n_workers=3),
    _make("reach_rush", REACH, 250, RUSH, seed=183, people="unaware", n_workers=3, jobs="low_work",
          ends_on_contact=True),
    # full speed by the tool
    _make("reach_tool_rush", REACH, 200, RUSH, seed=184, control="tool", n_workers=0),
    _make("pick_twist_rush", PICK, 200, RUSH, seed=185, control="twist", n_workers=0),
    _make("drywall_twist_rush", DRYWALL, 200, RUSH, seed=186, control="twist", people="hurried"),
    # again, and from a saved state
    _make("reach_episodes", REACH, 240, seed=132, play=play_episodes, n_workers=(0, 2),
          bodies="any"),
    _make("pick_episodes", PICK, 240, seed=133, play=play_episodes, object_noise_m=0.004),
    _make("delivery_episodes", DELIVERY, 240, seed=134, play=play_episodes),
    _make("drywall_episodes", DRYWALL, 180, seed=135, play=play_episodes),
    _make("hand_episodes", HAND, 180, seed=136, play=play_episodes),
    _make("reach_again", REACH, 160, seed=137, play=play_again, n_workers=2, cameras=LATE,
          shield="ssm"),
    _make("reach_again_faulty", REACH, 160, seed=138, play=play_again, people="hurried",
          faults=_fault("out_of_step", 3.0), estimator="paper_restarts"),
    _make("delivery_again", DELIVERY, 300, seed=139, play=play_again),
    _make("pick_again", PICK, 200, seed=140, play=play_again, object_noise_m=0.004),
    _make("drywall_again", DRYWALL, 200, seed=141, play=play_again),
    _make("hand_again", HAND, 300, seed=142, play=play_again, observes_shield=True, shield="qp"),
)  # fmt: skip
PIXELS = (
    _make("reach_pixels", REACH, 40, seed=92, perception="pixels"),
    _make("site_pixels_varied", REACH, 20, seed=93, perception="pixels", scene="site", n_workers=2,
          appearance="varied"),
    _make("reach_pixels_late", REACH, 24, seed=149, perception="pixels", cameras=LATE,
          faults=IMAGE_FAULTS[:4], n_workers=2, people="hurried"),
    _make("pick_pixels_blurred", PICK, 16, RUSH, seed=150, perception="pixels", people="headlong",
          faults=[{"kind": "motion_blur", "cameras": ("all",), "amount": 0.04},
                  {"kind": "late", "cameras": (1, 2), "amount": 0.12}]),
    _make("site_pixels_dropped", REACH, 20, seed=151, perception="pixels", scene="site",
          faults=[{"kind": "dropped", "cameras": ("all",), "amount": 0.5},
                  {"kind": "frozen", "cameras": (0,), "from_s": 0.3}]),
    _make("reach_pixels_again", REACH, 24, seed=143, perception="pixels", play=play_again,
          n_workers=2, kept_cameras=[0, 1, 2]),
    _make("delivery_pixels_faults", DELIVERY, 15, seed=94, perception="pixels", n_workers=1,
          faults=IMAGE_FAULTS),
)  # fmt: skip
BOUNDS = tuple(
    Probe(name=f"bounds_{env_id}", play=partial(play_bounds, env_id, {"perception": "none"}),
          subject=env_id, is_short=True)
    for env_id in doors.ENV_IDS
) + tuple(
    Probe(name=f"bounds_{env_id}_{end}", is_short=True, subject=env_id,
          play=partial(play_bounds, env_id, {"perception": "none", **options}))
    for env_id in (REACH, PICK, HAND, DRYWALL, DELIVERY)
    for end, options in (
        ("all", {"forecast_s": (0.2, 0.6), "observes_shield": True, "shield": "qp",
                 "covariance_terms": ("towards_robot", "factor"), "n_workers": 2}),
        ("far", {"forecast_s": (0.9,), "covariance_terms": ("factor",)}),
    )
)  # fmt: skip
BATCHES = tuple(
    Probe(name=f"batch_{name}", subject=env_id, is_short=name == "reach",
          play=partial(play_batch, env_id, seed, n_steps, options),
          inputs=partial(record_batch, env_id, seed, n_steps, options, n_moments, agent))
    for name, env_id, seed, n_steps, n_moments, agent, options in (
        ("reach", REACH, 300, 60, 150, "scripted",
         {"n_workers": 2, "shield": "qp", "bodies": "any"}),
        ("reach_slowed", REACH, 301, 90, 200, "scripted_slowed",
         {"people": "unaware", "cameras": LATE, "forecast_s": (0.3,), "n_workers": (0, 2)}),
        ("reach_truth", REACH, 321, 80, 160, "scripted",
         {"perception": "truth", "people": "unaware", "shield": "pfl", "n_workers": 2}),
        ("reach_faulty", REACH, 323, 70, 150, "scripted",
         {"faults": _fault("out_of_step", 3.0), "estimator": "kalman", "shield": "ssm"}),
        ("reach_particles", REACH, 304, 12, 24, NOISE, {"estimator": "paper_restarts"}),
        ("reach_triangulated", REACH, 320, 60, 100, NOISE, {"estimator": "triangulation"}),
        ("pick", PICK, 306, 350, 400, "scripted", {"object_noise_m": 0.004}),
        ("hand", HAND, 307, 350, 400, "scripted", {"observes_shield": True, "shield": "qp"}),
        ("drywall", DRYWALL, 308, 350, 400, "scripted", {"people": "hurried"}),
        ("delivery", DELIVERY, 309, 350, 400, "scripted", {"n_workers": (1, 3)}),
        ("goals", REACH_GOAL, 321, 50, 120, NOISE, {"n_workers": 2}),
        ("pick_goals", PICK_GOAL, 311, 60, 120, NOISE, {"scene": "site"}),
    )
)  # fmt: skip
POOR = [
    {"name": f"camera_{k}", "eye_m": eye, "target_m": (2.0, 2.2, 1.0), "field_deg": 45.0}
    for k, eye in enumerate(((2.9, 2.6, 2.45), (-9.0, 2.6, 2.45), (0.1, 0.1, 0.2)))
]
"""Cameras that look past the room, hang outside of it, and inside the robot."""
RIGS = tuple(
    Probe(name=f"rig_{name}", subject=REACH, is_short=True,
          play=partial(play_rig, REACH, {"perception": "keypoints", **options}))
    for name, options in (
        ("lab", {}), ("site", {"scene": "site"}), ("gopro", {"rig": "lab_gopro"}),
        ("one", {"kept_cameras": [2]}), ("poor", {"cameras": POOR}),
    )
)  # fmt: skip
MODELS = tuple(
    Probe(name=f"model_{name}", subject=env_id, is_short=True,
          play=partial(play_model, env_id, {"perception": "none", **options}))
    for name, env_id, options in (
        ("joint", REACH, {"joint_speed_share": 0.7}), ("tool", REACH, {"control": "tool"}),
        ("twist", PICK, {"control": "twist"}), ("board", DRYWALL, {}), ("base", DELIVERY, {}),
        ("gripper", REACH, {"robot": "ur10e_gripper"}),
    )
)  # fmt: skip
JUDGED = tuple(
    Probe(name=f"goals_{env_id}", play=partial(play_judged, env_id),
          inputs=partial(draw_goals, env_id), subject=env_id, is_short=True)
    for env_id in (REACH_GOAL, PICK_GOAL)
)  # fmt: skip
PARTS = (
    Probe(name="settings", play=describe_settings, inputs=name_settings, is_short=True),
    Probe(name="presets", play=describe_presets, is_short=True),
    Probe(name="looks_lab", subject=REACH, is_short=True,
          play=partial(dress_scene, REACH, {"n_workers": 3, "bodies": "any"})),
    Probe(name="looks_site", subject=REACH, is_short=True,
          play=partial(dress_scene, REACH, {"scene": "site"})),
    Probe(name="spots", play=list_spots, is_short=True),
    Probe(name="reach_of_robots", play=measure_reach, is_short=True),
    Probe(name="identities", play=compare_tracks, is_short=True),
    Probe(name="identities_crowd", play=mistake_tracks, is_short=True),
    *(
        Probe(name=f"in_hand_{env_id}", play=partial(take_in_hand, env_id), subject=env_id,
              is_short=True)
        for env_id in (PICK, HAND)
    ),
)  # fmt: skip
PLACES: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("lab_arm", REACH, {"n_workers": 2, "bodies": "any"}),
    ("site_arm", REACH, {"scene": "site"}),
    ("studs", PICK, {}),
    ("hand", HAND, {}),
    ("board", DRYWALL, {}),
    ("base", DELIVERY, {}),
    ("lab_lenses", REACH, {"rig": "lab_gopro"}),
    ("site_studs", PICK, {"scene": "site"}),
    ("site_hand", HAND, {"scene": "site"}),
    ("site_board", DRYWALL, {"scene": "site"}),
)
"""Scenes: a name, an environment and its arguments."""
SCENES = tuple(
    Probe(name=f"{kind}_{name}", play=partial(play_kind, env_id, {"perception": "none", **options}),
          subject=env_id, is_short=True)
    for kind, play_kind in (("scene", play_scene), ("contacts", play_contacts))
    for name, env_id, options in PLACES
)  # fmt: skip
PICTURES = tuple(
    Probe(name=f"picture_{env_id}{end}",
          play=partial(play_pictures, env_id, options),
          inputs=partial(record_actions, env_id, SEED, "scripted", 3, options),
          subject=env_id, needs_pixels=True, tolerance=0.01)
    for env_id, end, options in (
        *((each, "", {"perception": "keypoints"}) for each in (REACH, DELIVERY, DRYWALL)),
        (REACH, "_pixels", {"perception": "pixels", "n_workers": 2}),
    )
)  # fmt: skip
PROBES: tuple[Probe, ...] = (
    *SCENES,
    *PICTURES,
    *BOUNDS,
    *JUDGED,
    *MODELS,
    *RIGS,
    *PARTS,
    *WHOLE,
    *COVERING,
    *MORE,
    *PIXELS,
    *BATCHES,
)
