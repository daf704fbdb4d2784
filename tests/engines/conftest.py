"""A cluster of Ray with two machines of one core each, on this one."""

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="module")
def cluster() -> Iterator[object]:
    """Two nodes; this process is connected to them."""
    import ray
    from ray.cluster_utils import Cluster

    os_limits = {"num_cpus": 1, "object_store_memory": 150_000_000, "include_dashboard": False}
    made = Cluster(initialize_head=True, head_node_args=os_limits)
    made.add_node(num_cpus=1, object_store_memory=150_000_000)
    ray.init(address=made.address, log_to_driver=False, logging_level="ERROR")
    yield made
    ray.shutdown()
    made.shutdown()
