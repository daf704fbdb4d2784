"""A cluster of two machines: equal parts, killed workers, a lost machine, what is not there."""

import os
import signal
import textwrap
from functools import partial

import calls
import cloudpickle
import numpy as np
import pytest
import ray
from calls import (
    STUDY,
    cores,
    die,
    die_once,
    fail,
    lacks_a_module,
    lacks_weights,
    parts_of,
)  # fmt: skip

import hrc_env
from hrc_env import run_experiment
from hrc_env.__main__ import main
from hrc_env.agents import checkpoints, ppo
from hrc_env.agents.learner_settings import PPOSettings
from hrc_env.agents.rllib import training
from hrc_env.agents.rllib.learner import RLlibPPO, RunnerSettings
from hrc_env.agents.rllib.runner_env import RunnerEnv, make_envs, try_environment
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.engines import cluster as ray_cluster
from hrc_env.engines.engine import engine_called
from hrc_env.engines.ray_tasks import RayTasks
from hrc_env.engines.registrations import pack
from hrc_env.evaluation.episodes import play_shards
from hrc_env.experiments.impact.experiment import Impact
from hrc_env.experiments.price.experiment import Price
from hrc_env.experiments.runner import make_cache
from hrc_env.experiments.setups import REFERENCE
from hrc_env.experiments.site.experiment import Site
from hrc_env.registration import import_files
from hrc_env.sb3 import HRCVecEnv
from tests.registrations import registrations_restored

pytestmark = pytest.mark.slow
cloudpickle.register_pickle_by_value(calls)  # which workers cannot import
ray.cloudpickle.register_pickle_by_value(calls)

REACH = {"task": "HRCReach-v0", "perception": "keypoints"}
MOST_UPDATES = 400
"""After which a killed worker must be there again."""
OWN = """
import numpy as np
import hrc_env
from hrc_env import Row, Study, columns


class Short(hrc_env.find_task("HRCReach-v0")):
    id = "HRCTravelled-v0"
    max_episode_steps = 6


def half(belief, velocities, dt_s):
    return 0.5 * velocities, {"share": np.full(len(velocities), 0.5)}


hrc_env.register_task(Short)
hrc_env.register_shield("half", half)
"""
FAILING = """
import os

import hrc_env


def failing(fail):
    def shield(belief, velocities, dt_s):
        if len(velocities) == 7:  # one or two are tried where it is registered and checked
            fail()
        return velocities, {}

    return shield


def fail():
    raise ValueError("this shield is broken")


hrc_env.register_shield("raises", failing(fail))
hrc_env.register_shield("exits", failing(lambda: os._exit(1)))
"""


@pytest.fixture(scope="module")
def shields(tmp_path_factory):
    """Shields of a user's file that fail, or end their process, where seven environments step."""
    path = tmp_path_factory.mktemp("shields") / "failing_shields.py"
    path.write_text(FAILING)
    with registrations_restored():
        import_files(str(path))
        yield


def silent(k, share):
    """Say nothing."""


def learning(n_runners: int, num_envs: int = 4, n_steps: int = 8, **of_runners: str):
    """A small PPO of both libraries."""
    settings = PPOSettings(n_steps=n_steps, batch_size=16)
    learner = ppo.make_learner(HRCVecEnv(1, **REACH), settings, 0)
    runners = RunnerSettings({**REACH, **of_runners}, n_runners, num_envs, 0, 1.0, pack())
    return learner, RLlibPPO(learner, settings, runners)


def weights_of_runners(learnt: RLlibPPO):
    """The weights of every runner's network."""
    return learnt.algorithm.env_runner_group.foreach_env_runner(
        lambda runner: runner.module.policy.state_dict(), local_env_runner=False
    )


def test_parts_are_those_of_one_process_though_a_worker_is_killed(cluster, tmp_path):
    for name in ("serial", "ray"):
        run_experiment(STUDY, tmp_path / name, engine=engine_called(name))
    assert parts_of(tmp_path / "serial") == parts_of(tmp_path / "ray")
    flag = tmp_path / "died"
    calls = [cores, partial(die_once, flag), cores]
    done = {each.k: each.result for each in RayTasks().run(calls, silent)}
    assert flag.exists()
    assert done[1] == {"died": True}
    assert [done[k]["cores"] for k in (0, 2)] == [1, 1]
    assert os.getpid() not in {done[k]["pid"] for k in (0, 2)}


def test_a_worker_that_dies_again_and_again_ends_it_with_its_error(cluster):
    with pytest.raises(HRCError, match="The worker of call 1 died 3 times"):
        list(RayTasks().run([die], silent))
    with pytest.raises(ConfigError, match="this cannot be"):
        list(RayTasks().run([fail], silent))


@pytest.mark.parametrize(
    ("shield", "error"),
    [
        ("raises", "A worker of Ray failed: ValueError: this shield is broken"),
        ("exits", "The worker of call 1 died 3 times"),
    ],
    ids=["raises", "exits"],
)
def test_episodes_that_end_every_worker_end_with_its_error(cluster, shields, capsys, shield, error):
    asked = ["--shield", shield, "--episodes", "7", "--engine", "ray", "--workers", "1"]
    assert main(["evaluate", "HRCReach-v0", *asked]) == 2
    assert error in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("shield", "error"),
    [
        (
            "raises",
            "The last error: ValueError: this shield is broken. The current policy is saved in",
        ),
        ("exits", "The last error: a process was killed or ran out of memory"),
    ],
    ids=["raises", "exits"],
)
def test_training_that_ends_every_worker_ends_with_its_error(
    cluster, shields, tmp_path, capsys, monkeypatch, shield, error
):
    monkeypatch.setattr(training, "WITHOUT_STEPS", 2)
    asked = ["--shield", shield, "--engine", "ray", "--workers", "1", "--num-envs", "7"]
    asked += ["--timesteps", "1000", "--no-film", "--out", str(tmp_path / "run")]
    assert main(["train", *asked]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "No worker completed a step in 2 updates" in said
    assert error in said
    assert (tmp_path / "run" / "policy.zip").exists()


def test_workers_that_cannot_begin_say_why(cluster):
    with pytest.raises(
        HRCError, match="could create its environments: Unknown estimator 'nonsense'"
    ):
        learning(1, estimator="nonsense")


def test_scores_are_those_of_one_process(cluster):
    asked = {**REACH, "max_episode_steps": 6}
    make = partial(hrc_env.make_agent, "random")
    one = play_shards(make, 66, 5, None, **asked)
    np.testing.assert_equal(play_shards(make, 66, 5, RayTasks(), **asked), one)


def test_what_a_file_registers_is_known_to_workers(cluster, tmp_path):
    path = tmp_path / "own_things.py"
    path.write_text(OWN)
    import_files(str(path))
    asked = {"task": "HRCTravelled-v0", "shield": "half", "perception": "keypoints"}
    make = partial(hrc_env.make_agent, "random")
    one = play_shards(make, 3, 5, None, **asked)
    assert play_shards(make, 3, 5, RayTasks(), **asked) == one
    assert one[0]["l"] == 6


def test_registrations_reach_a_machine_without_the_file(process, tmp_path):
    """A process that inherits nothing, after the file is gone."""
    path = tmp_path / "own_things.py"
    path.write_text(OWN)
    packed = tmp_path / "packed"
    packing = f"""
        import pickle
        from pathlib import Path
        from hrc_env.engines.registrations import pack
        Path({str(packed)!r}).write_bytes(pickle.dumps(pack()))
    """
    found = process("-c", textwrap.dedent(packing), HRC_ENV_IMPORT=str(path))
    assert found.returncode == 0, found.stderr
    path.unlink()
    unpacking = f"""
        import pickle, gymnasium
        from pathlib import Path
        pickle.loads(Path({str(packed)!r}).read_bytes()).unpack()
        env = gymnasium.make("HRCTravelled-v0", perception="none", shield="half")
        env.reset(seed=0)
        print("steps", env.spec.max_episode_steps)
    """
    found = process("-c", textwrap.dedent(unpacking), HRC_ENV_IMPORT=None, HRC_ENV_REGISTERED=None)
    assert "steps 6" in found.stdout, found.stderr


def test_a_file_that_wants_a_module_that_is_not_there_is_named(tmp_path):
    from hrc_env.core.snapshot import Snapshot
    from hrc_env.engines.registrations import Registrations

    text = b"import no_such_module_anywhere"
    packed = Registrations(Snapshot(), {"/not/here/mine.py": text}, ("/not/here/mine.py",))
    with pytest.raises(
        HRCError, match=r"/not/here/mine.py cannot be imported on this worker.*no_s"
    ):
        packed.unpack()


def test_a_policy_is_of_both_libraries(cluster, tmp_path):
    learner, learnt = learning(1)
    try:
        ours = learner.policy.state_dict()
        for theirs in weights_of_runners(learnt):  # before the first update, too
            assert all((theirs[name] == ours[name]).all() for name in ours)
        before = {name: each.clone() for name, each in ours.items()}
        sampled = learnt.update(proximity=1.5)
        assert 32 <= sampled.n_steps < 40
        learnt.pull()
        after = learner.policy.state_dict()
        assert any((before[name] != after[name]).any() for name in before)
        for theirs in weights_of_runners(learnt):
            assert all((theirs[name] == after[name]).all() for name in after)
        assert learner.policy.optimizer.state_dict()["state"]
        scale = learner.get_vec_normalize_env().ret_rms
        assert scale.count > 20
        assert learnt._each(lambda envs: envs.proximity) == [1.5]
    finally:
        learnt.close()
    path = tmp_path / "policy.zip"
    checkpoints.save(learner, path, {"environment": REACH})
    resumed = checkpoints.resume(path, HRCVecEnv(1, **REACH))
    assert resumed.get_vec_normalize_env().ret_rms.var == pytest.approx(float(scale.var))
    score = hrc_env.evaluate(str(path), 2, **REACH, max_episode_steps=5)
    assert score.episodes == 2


def test_training_goes_on_without_a_runner_and_without_a_machine(cluster):
    lost = cluster.add_node(num_cpus=1, object_store_memory=150_000_000)
    _, learnt = learning(3)
    try:
        learnt.update(1.5)
        group = learnt.algorithm.env_runner_group
        pids = group.foreach_env_runner(lambda runner: os.getpid(), local_env_runner=False)
        os.kill(pids[0], signal.SIGKILL)
        sampled = learnt.update(1.5)
        assert sampled.n_steps >= 2 * 32  # of those that live
        for _ in range(MOST_UPDATES):
            if sampled.n_restarts > 0 and sampled.n_runners == 3:
                break
            sampled = learnt.update(1.5)
        assert (sampled.n_restarts > 0, sampled.n_runners) == (True, 3)
        scales = learnt._each(lambda envs: envs.rewards_state())
        assert [weight for _, weight in scales] == [1.5] * 3
        counts = [scale.count for scale, _ in scales]
        assert min(counts) > max(counts) / 2  # one that began anew goes on with another's
        newest = weights_of_runners(learnt)
        for each in newest[1:]:
            assert all((each[name] == newest[0][name]).all() for name in each)
        cluster.remove_node(lost)
        steps = [learnt.update(1.5).n_steps for _ in range(3)]
        assert min(steps) >= 32
        learnt.pull()
    finally:
        learnt.close()


def test_runners_meet_all_phases_and_count_what_ends():
    env = RunnerEnv(make_envs(3, {**REACH, "max_episode_steps": 5}), 0.9)
    env.reset(seed=2)
    rewards, n_ended = [], 0
    for _ in range(12):
        _, reward, terminated, truncated, infos = env.step(env.action_space.sample())
        n_ended += int((terminated | truncated).sum())
        rewards.append(reward)
        assert infos == {}
    finished = env.take_finished()
    assert len(finished) == n_ended >= 3 * 2
    assert {each["l"] for each in finished} > {5.0}  # the first ones end early
    assert env.take_finished() == []
    assert abs(sum(rewards)).max() <= 12 * 10
    again = RunnerEnv(make_envs(3, {**REACH, "max_episode_steps": 5}), 0.9)
    assert (again.reset(seed=2)[0] == RunnerEnv(
        make_envs(3, {**REACH, "max_episode_steps": 5}), 0.9).reset(seed=2)[0]).all()  # fmt: skip
    assert (again.reset(seed=3)[0] != env.reset(seed=2)[0]).any()


@pytest.mark.parametrize(
    ("said", "remedy"),
    [
        ("Version mismatch: The cluster was started with Ray 2.55", "same versions of Ray and of"),
        ("Invalid cluster authentication token", "RAY_AUTH_TOKEN"),
        ("Connection refused", "ray start --head"),
    ],
)
def test_what_ray_says_of_a_cluster_has_a_remedy(said, remedy):
    assert remedy in ray_cluster._remedy(said)


def test_machines_that_cannot_work_are_named(cluster, monkeypatch):
    machines = ray_cluster.list_machines()
    assert len(machines) == 2
    ray_cluster.check_machines(machines, partial(try_environment, REACH))
    with pytest.raises(ConfigError, match=r"Machine .* cannot work: no weights here"):
        ray_cluster.check_machines(machines, lacks_weights)
    with pytest.raises(ConfigError, match=r"cannot import 'no_such_module'.*--import"):
        ray_cluster.check_machines(machines, lacks_a_module)
    monkeypatch.setattr(ray_cluster, "VERSION", "0.0.9")
    with pytest.raises(ConfigError, match=r"has hrc_env .*, but this one has 0.0.9"):
        ray_cluster.check_machines(machines)


def test_more_workers_than_cores_are_said_and_find_a_place(cluster):
    said: list[str] = []
    machines = ray_cluster.list_machines()
    share = ray_cluster.share_of(5, machines, said.append)
    assert 0 < share <= 2 / 5
    assert said == ["5 workers on 2 cores: the workers take turns, so that this is not faster."]
    assert ray_cluster.share_of(2, machines, said.append) == 1.0
    found = list(RayTasks(5, note=said.append).run([cores] * 6, silent))
    assert sorted(each.k for each in found) == list(range(6))


@pytest.mark.parametrize(
    "experiment",
    [
        Impact(n_seeds=3, n_steps=8, policies=("scripted",), setups=("truth", REFERENCE)),
        Site(n_seeds=1, seconds=1.5, n_closed=1, estimators=("particle",)),
        Price(
            setups=("truth", "four_cameras"),
            n_settings=2,
            n_choosing=2,
            n_kept=1,
            n_proof=2,
            n_steps=8,
        ),
    ],
    ids=["impact", "site", "price"],
)
def test_experiments_have_the_parts_of_one_process(cluster, weights, tmp_path, experiment):
    played = {}
    for name in ("serial", "ray"):
        cache = make_cache(experiment, tmp_path / name, lambda *_: None, engine_called(name))
        played[name] = experiment.play(cache)
    assert played["serial"] == played["ray"]
