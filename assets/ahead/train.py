"""Train the network of `hrc_env/tracking/forecast.py`:  python assets/ahead/train.py

Writes assets/ahead/ahead.npz; about five minutes on one core, torch needed. The inputs are the
environment's own workers as the estimator `kalman` tracks them through the emulator, with and
without failing cameras, and their ground truth. Half of the samples are augmented so that the
network generalizes beyond this one worker: faster or slower, of another size, turning while
walking, accelerating, walking on where the worker would have stopped. Left and right are exchanged
in half of them.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import nn

from benchmarks.tracking.rigs import DT_S
from benchmarks.tracking.tracks import Tracks, follow_env
from hrc_env.core.skeleton import MIRROR, N_JOINTS, TORSO
from hrc_env.tracking.forecast import N_INPUTS, describe
from hrc_env.tracking.oracle import ORACLE_STD_M

OUT = Path(__file__).parent / "ahead.npz"
HORIZONS_S = (0.1, 0.2, 0.4, 0.6, 0.8, 1.0)
SCALE_M = np.array([0.05, 0.1, 0.2, 0.3, 0.4, 0.5], np.float32)
"""Unit of the network's displacements at each horizon [m]."""
WARM_UP, N_FRAMES = 25, 300
N_AHEAD = 39
"""Frames of the future that a sample needs: 1 s at 1.5 times the pace, and a frame for rates."""
BOUNDS = (np.log(ORACLE_STD_M), np.log(1.5))
SETS = (  # seeds, lively, failing
    (range(100_000, 100_096), False, False),
    (range(101_000, 101_096), True, False),
    (range(102_000, 102_096), False, True),
    (range(103_000, 103_096), True, True),
)
GIVEN_SHARE = 0.15
"""Share of the samples with the true state of the worker."""
CHANGED_SHARE, GO_ON_SHARE = 0.6, 0.75
PACE, SIZE = (0.67, 1.5), (0.9, 1.1)
TURN_RAD_S, TURN_RAD_S2, PUSH_M_S2 = 1.2, 2.0, 0.7
"""Standard deviations of the turning rate, of its growth, and of a walker's acceleration, in
augmented samples."""
FLIP = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Samples:
    """N moments of one worker, and the frames of their future."""

    path: np.ndarray
    """(M, J, 3) true joints, sequences one after the other."""
    start: np.ndarray
    """Row of `path` of each moment, (N,)."""
    seen: tuple[np.ndarray, np.ndarray, np.ndarray]
    """Means (N, J, 3), velocities (N, J, 3), covariances (N, J, 3, 3) as estimated."""
    speed: np.ndarray
    """(M, J, 3) true velocities."""


def gather(sets: list[Tracks]) -> Samples:
    """Collect all moments with a tracked worker and a known future."""
    paths, speeds, starts, seen, begin = [], [], [], [], 0
    for tracks in sets:
        n_frames, n = tracks.truth.shape[:2]
        use = slice(WARM_UP, n_frames - N_AHEAD - 1)
        estimates = tracks.estimates[use]
        t, s = np.nonzero([each.tracked[:, 0] for each in estimates])
        starts.append(begin + s * n_frames + t + WARM_UP)
        seen.append([
            np.stack([getattr(each, name)[:, 0] for each in estimates])[t, s]
            for name in ("mean_world", "velocity_world", "cov_world")
        ])  # fmt: skip
        paths.append(tracks.truth.swapaxes(0, 1).reshape(-1, N_JOINTS, 3))
        speeds.append(tracks.speed.swapaxes(0, 1).reshape(-1, N_JOINTS, 3))
        begin += n * n_frames
    each = [np.concatenate(parts) for parts in zip(*seen, strict=True)]
    return Samples(
        np.concatenate(paths), np.concatenate(starts), tuple(each), np.concatenate(speeds)
    )


def turned(points: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Points (..., 3) turned about the vertical by angles that broadcast to (...)."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = points[..., 0], points[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y, points[..., 2]], -1)


def future(samples: Samples, start: np.ndarray, rng: np.random.Generator):
    """Joints (n, H, J, 3) at the horizons, changed; pace, turning rate, size of the change."""
    n, pick = len(start), np.arange(len(start))
    on = rng.random(n) < CHANGED_SHARE
    pace = np.where(on, np.exp(rng.uniform(*np.log(PACE), n)), 1.0)
    size = np.where(on, rng.uniform(*SIZE, n), 1.0)
    turn, gather = (np.where(on, rng.normal(0, s, n), 0.0) for s in (TURN_RAD_S, TURN_RAD_S2))
    time_s = DT_S * np.arange(N_AHEAD + 1) / pace[:, None]
    angle = turn[:, None] * time_s + 0.5 * gather[:, None] * time_s**2
    path = samples.path[start[:, None] + np.arange(N_AHEAD + 1)]
    root = path[:, :, TORSO].mean(2)
    step = np.diff(root, axis=1)
    now = samples.speed[start][:, TORSO].mean(1) * DT_S  # of a frame as recorded
    goes_on = on & (rng.random(n) < GO_ON_SHARE)
    step[goes_on, :, :2] = now[goes_on, None, :2]
    push = on[:, None] * rng.normal(0, PUSH_M_S2, (n, 2))
    push *= np.minimum(np.linalg.norm(now[:, :2], axis=1) / DT_S, 1.0)[:, None]
    step = turned(step, 0.5 * (angle[:, 1:] + angle[:, :-1]))
    step[..., :2] += push[:, None] * np.diff(0.5 * time_s**2, axis=1)[..., None]
    places = root[:, :1] + np.concatenate([np.zeros((n, 1, 3)), np.cumsum(step, 1)], 1)
    path = turned(path - root[:, :, None], angle[..., None]) + places[:, :, None]
    later = np.empty((n, len(HORIZONS_S), N_JOINTS, 3))
    for k, horizon_s in enumerate(HORIZONS_S):
        frame = horizon_s * pace / DT_S
        first = np.floor(frame + 1e-9).astype(int)
        share = (frame - first)[:, None, None]
        second = np.minimum(first + 1, N_AHEAD)
        later[:, k] = (1 - share) * path[pick, first] + share * path[pick, second]
    return later, pace, turn, size


def batch(samples: Samples, n: int, rng: np.random.Generator) -> list[torch.Tensor]:
    """Inputs (n, I), displacements (n, H, J, 3), variances (n, J, 3), their axes (n, J, 3, 3)."""
    pick = rng.integers(0, len(samples.start), n)
    start = samples.start[pick]
    mean, velocity, cov = (array[pick] for array in samples.seen)
    given = rng.random(n) < GIVEN_SHARE
    mean[given], velocity[given] = samples.path[start[given]], samples.speed[start[given]]
    cov[given] = ORACLE_STD_M**2 * np.eye(3)
    later, pace, turn, size = future(samples, start, rng)
    about = mean - mean[:, TORSO].mean(1, keepdims=True)
    spin = np.stack([-about[..., 1], about[..., 0], 0 * about[..., 0]], -1)
    velocity = (velocity * pace[:, None, None] + turn[:, None, None] * spin) * size[:, None, None]
    moved = (later - mean[:, None]) * size[:, None, None, None]
    mean = mean * size[:, None, None]
    flip = rng.random(n) < 0.5  # in the world: the heading turns round with the body
    for array in (mean, velocity):
        array[flip] = array[flip][:, MIRROR] * FLIP
    moved[flip] = moved[flip][:, :, MIRROR] * FLIP
    cov[flip] = cov[flip][:, MIRROR] * FLIP * FLIP[:, None]
    inputs, angle = np.empty((n, N_INPUTS), np.float32), np.empty(n)
    for k in range(n):
        cos, sin, _ = describe(mean[k], velocity[k], cov[k], np.array(BOUNDS), inputs[k])
        angle[k] = -np.arctan2(sin, cos)
    variance, axes = np.linalg.eigh(cov)
    axes = turned(axes.swapaxes(-1, -2), angle[:, None, None]).swapaxes(-1, -2)
    moved = turned(moved, angle[:, None, None]) / SCALE_M[:, None, None]
    return [
        torch.from_numpy(np.ascontiguousarray(array, np.float32))
        for array in (inputs, moved, variance, axes)
    ]


def loss_of(answer: torch.Tensor, moved, variance, axes) -> torch.Tensor:
    """Return the negative log-likelihood of the displacement beyond constant velocity, and the
    squared error."""
    n_moved = len(HORIZONS_S) * N_JOINTS * 3
    error = moved - answer[:, :n_moved].reshape(moved.shape)
    log_std = answer[:, n_moved:].reshape(moved.shape[:3]).clamp(-6, 4)
    along = torch.einsum("njik,nhji->nhjk", axes, error)
    scale = torch.from_numpy(SCALE_M)[:, None, None]
    total = variance[:, None] / scale**2 + torch.exp(2 * log_std)[..., None]
    likelihood = 0.5 * (along**2 / total + torch.log(total)).sum(-1).mean()
    return likelihood + (error**2).sum(-1).mean()


def train(samples: Samples, steps: int, width: int, seed: int):
    """The layers, and mean and deviation of the inputs."""
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    rng = np.random.default_rng(seed)
    first = batch(samples, 8192, rng)[0]
    mean, std = first.mean(0), first.std(0) + 1e-3
    last = nn.Linear(width, len(HORIZONS_S) * 4 * N_JOINTS)
    nn.init.zeros_(last.weight), nn.init.zeros_(last.bias)
    net = nn.Sequential(
        nn.Linear(N_INPUTS, width), nn.ReLU(), nn.Linear(width, width), nn.ReLU(), last
    )
    optimiser = torch.optim.AdamW(net.parameters(), 3e-3, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 3e-3, steps)
    for step in range(steps):
        inputs, *wanted = batch(samples, 512, rng)
        loss = loss_of(net((inputs - mean) / std), *wanted)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        if step % 500 == 499:
            print(f"{step + 1} of {steps}: {loss.item():.3f}", flush=True)
    return net, mean, std


def save(path: Path, net: nn.Sequential, mean: torch.Tensor, std: torch.Tensor) -> None:
    """Write the file that `forecast.load_network` reads; scales go into the weights."""
    layers = [(net[k].weight.detach().numpy().T, net[k].bias.detach().numpy()) for k in (0, 2, 4)]
    mean, std = mean.numpy(), std.numpy()
    n_moved, n_horizons = len(HORIZONS_S) * N_JOINTS * 3, len(HORIZONS_S)

    def by_horizon(array: np.ndarray) -> list[np.ndarray]:
        """(..., H 45 + H 15) to (..., H, 60)."""
        parts = array[..., :n_moved], array[..., n_moved:]
        return [part.reshape(*array.shape[:-1], n_horizons, -1) for part in parts]

    moved, log_std = by_horizon(layers[2][0])
    weight_3 = np.concatenate([moved * SCALE_M[:, None], log_std], -1).swapaxes(0, 1)
    moved, log_std = by_horizon(layers[2][1])
    bias_3 = np.concatenate([moved * SCALE_M[:, None], log_std + np.log(SCALE_M)[:, None]], -1)
    weight_1 = layers[0][0] / std[:, None]
    stored = {
        "weight_1": weight_1, "bias_1": layers[0][1] - mean @ weight_1,
        "weight_2": layers[1][0], "bias_2": layers[1][1], "weight_3": weight_3, "bias_3": bias_3,
    }  # fmt: skip
    stored = {name: np.ascontiguousarray(array, np.float32) for name, array in stored.items()}
    np.savez_compressed(path, horizons_s=HORIZONS_S, log_std=BOUNDS, **stored)


def main() -> None:
    """Gather, train, save."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--steps", type=int, default=3500)
    parser.add_argument("--width", type=int, default=64)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    sets = []
    for seeds, lively, failing in SETS:
        sets.append(follow_env(list(seeds), N_FRAMES, lively, failing))
        print(f"{len(seeds)} workers followed", flush=True)
    samples = gather(sets)
    print(f"{len(samples.start)} moments", flush=True)
    save(options.out, *train(samples, options.steps, options.width, options.seed))


if __name__ == "__main__":
    main()
