"""Domain randomisation of cameras: rigs, what is told wrongly of them, delays and light."""

import gymnasium
import numpy as np

import hrc_env

rigs = hrc_env.RigDistribution(
    max_shift_m=0.3,  # each camera hangs so far from its place at most, along each axis
    max_rotation_rad=0.1,
    max_focal_change=0.05,
    n_cameras=(2, 4),  # which of them hang is drawn, too
)
faults = [
    {"kind": "wrong_rotation", "cameras": ["all"], "amount": (0.0, 0.02)},  # [rad]
    {"kind": "late", "cameras": ["all"], "amount": (0.0, 0.12)},  # [s]
]
arguments = {
    "perception": "keypoints",
    "cameras": rigs,
    "faults": faults,
    "appearance": {"light": (0.3, 1.0)},
}
envs = gymnasium.make_vec("HRCReach-v0", num_envs=4, **arguments)
envs.reset(seed=0)
drawn = envs.get_attr("rig")
print("cameras of each environment:", [len(rig) for rig in drawn])
assert len({rig[0].eye_world for rig in drawn}) == 4

# Every episode has its own, and environment k is the single environment of seed + k, bit for bit.
single = gymnasium.make("HRCReach-v0", **arguments)
single.reset(seed=2)
assert single.unwrapped.rig == drawn[2]
for _ in range(50):
    actions = np.zeros(envs.action_space.shape, np.float32)
    observations, *_, infos = envs.step(actions)
    observation, *_ = single.step(actions[2])
np.testing.assert_array_equal(observations[2], observation)
print("errors of the tracked workers [m]:", infos["tracking/mpjpe_m"].round(3))

# One episode with other cameras, and distributions that cannot be.
envs.reset(seed=0, options={"cameras": ["camera_1", "camera_3"], "faults": []})
assert [len(rig) for rig in envs.get_attr("rig")] == [2] * 4
for wrong in (
    {"cameras": {"max_shift_m": 50.0}},
    {"faults": [{**faults[1], "amount": (0.3, 0.0)}]},
):
    try:
        gymnasium.make("HRCReach-v0", perception="keypoints", **wrong)
    except hrc_env.ConfigError as error:
        print(error)
    else:
        raise AssertionError(f"{wrong} was taken")
