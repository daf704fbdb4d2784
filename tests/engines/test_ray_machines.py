"""A machine of a cluster that lacks what level `pixels` needs: one sentence says which, and how
to get it."""

import pytest

from hrc_env.__main__ import main

pytestmark = pytest.mark.slow

LACKING = {
    "OpenGL": ({"MUJOCO_GL": "disable"}, "Rendering is switched off by MUJOCO_GL='disable': unset"),
    "weights": ({"HRC_ENV_CACHE": "/proc/none"}, "Weights cannot be written into /proc/none. Choo"),
}
"""Variables of a machine without it, and the beginning of its answer."""
TRAIN = "train --perception pixels --num-envs 1 --timesteps 10 --no-film --engine ray"
EXPERIMENT = "experiment lab --quick --engine ray"


@pytest.fixture(scope="module", params=LACKING.values(), ids=LACKING)
def answer(request, weights):
    """The answer of a cluster whose one worker lacks something that this process has."""
    import ray
    from ray.cluster_utils import Cluster

    variables, words = request.param
    little = {"object_store_memory": 150_000_000}
    made = Cluster(initialize_head=True, head_node_args={
        "num_cpus": 0, "include_dashboard": False, **little
    })  # fmt: skip
    made.add_node(num_cpus=1, env_vars=variables, **little)
    ray.init(address=made.address, log_to_driver=False, logging_level="ERROR")
    yield words
    ray.shutdown()
    made.shutdown()


@pytest.mark.parametrize("words", [TRAIN, EXPERIMENT], ids=["train", "experiment"])
def test_a_machine_that_lacks_something_says_so(answer, words, tmp_path, capsys):
    assert main([*words.split(), "--out", str(tmp_path / "out")]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert " cannot work: " + answer in said
    assert "Traceback" not in said
