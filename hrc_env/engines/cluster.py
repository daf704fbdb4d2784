"""Connection to Ray clusters, and checks of the requirements on their machines."""

import os
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

from hrc_env.core.errors import ConfigError, HRCError, MissingExtraError
from hrc_env.core.machine import CORES, n_cores
from hrc_env.engines.registrations import Registrations, pack

try:
    import ray
    from ray.exceptions import AuthenticationError, RayError, RayTaskError
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy
except ModuleNotFoundError as missing:
    raise MissingExtraError(
        f"The engine ray needs {missing.name}, which is not installed. Install it with: pip "
        'install "hrc_env[ray]"  (in a checkout: pip install -c constraints.txt -e ".[ray]")'
    ) from missing

VERSION = version("hrc_env")
START_S = "300"
"""Maximum time that a machine under load may take to start Ray [s]; Ray's default is 30 s."""
ANSWER_S = 10.0
"""Maximum time that a cluster may take to answer [s]."""
STORE_BYTES = 500_000_000
"""Size of the shared memory of a cluster that this process starts [bytes]."""
Note = Callable[[str], None]
"""Callback that receives a message for the user."""


@dataclass(frozen=True, slots=True)
class Machine:
    """A machine of a cluster."""

    id: str
    address: str
    n_cores: float


@contextmanager
def connected(
    address: str | None, note: Note = print, dashboard: bool = False
) -> Iterator[list[Machine]]:
    """Connect to a cluster and yield its machines.

    Args:
        address: address of a cluster: "auto" on one of its machines, "HOST:6379", or
            "ray://HOST:10001"; None: a cluster on this machine, which is started here and stopped
            at the end.
        note: callback that receives messages about the cluster.
        dashboard: whether a cluster started on this machine runs Ray's dashboard.

    Raises:
        ConfigError: there is no cluster at the address, its version of Ray or Python differs, or it
            requires a token.
    """
    os.environ.setdefault("RAY_raylet_start_wait_time_s", START_S)
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    is_ours = not ray.is_initialized()
    if is_ours:
        options: dict[str, Any] = {"log_to_driver": False, "logging_level": "ERROR"}
        if address is None:
            options |= {"num_cpus": n_cores(), "include_dashboard": dashboard}
            options["object_store_memory"] = STORE_BYTES
        if address is not None and address != "auto":
            _check_answers(address)
        try:
            context = ray.init(address=address or "local", **options)
        except AuthenticationError as error:
            raise _refused(
                address, error, "the cluster requires a token: RAY_AUTH_TOKEN=..."
            ) from error
        except (ConnectionError, RuntimeError, ValueError, RayError) as error:
            raise _refused(address, error, _remedy(str(error))) from error
        if dashboard and (url := getattr(context, "dashboard_url", "")):
            note(f"Ray's dashboard: http://{url}")
    try:
        yield list_machines()
    finally:
        if is_ours:
            ray.shutdown()


def _check_answers(address: str) -> None:
    """Raise `ConfigError` if nothing listens at an address; Ray itself would retry for minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not (host and port.isdigit()):
        raise ConfigError(f"--address must be auto, HOST:PORT or ray://HOST:PORT, got {address!r}.")
    try:
        socket.create_connection((host, int(port)), timeout=ANSWER_S).close()
    except (OSError, OverflowError) as error:
        raise _refused(address, error, _remedy("")) from error


def _refused(address: str | None, error: Exception, remedy: str) -> ConfigError:
    """Return the error for a cluster that cannot be used."""
    where = "on this machine" if address is None else f"at {address!r}"
    said = " ".join(str(error).split())[:400]
    return ConfigError(f"No Ray cluster was found {where}: {remedy}. ({said})")


def _remedy(said: str) -> str:
    """Return the remedy for an error message of Ray."""
    if "ersion mismatch" in said:
        return "all machines must have the same versions of Ray and of Python"
    if "oken" in said:
        return (
            "the cluster requires a token: RAY_AUTH_TOKEN=..., or a file named by "
            "RAY_AUTH_TOKEN_PATH"
        )
    return (
        "start one with `ray start --head`, join it from other machines with `ray start "
        "--address=HOST:6379`, and set --address to auto, HOST:6379 or ray://HOST:10001"
    )


def list_machines() -> list[Machine]:
    """Return the machines of the cluster that are alive and have CPU cores."""
    return [
        Machine(each["NodeID"], each["NodeManagerAddress"], each["Resources"]["CPU"])
        for each in ray.nodes()
        if each["Alive"] and each["Resources"].get("CPU", 0) > 0
    ]


def share_of(workers: int, machines: list[Machine], note: Note = print) -> float:
    """Return the fraction of a core to reserve for each worker so that all workers fit.

    Args:
        workers: number of workers.
        machines: machines of the cluster.
        note: callback that receives a warning if there are more workers than cores.
    """
    n = sum(each.n_cores for each in machines)
    if workers <= n:
        return 1.0
    note(f"{workers} workers on {n:g} cores: the workers take turns, so that this is not faster.")
    least = min(each.n_cores / -(-workers * each.n_cores // n) for each in machines)
    return int(least * 1000) / 1000


def check_machines(
    machines: list[Machine], works: Callable[[], None] | None = None, note: Note = print
) -> None:
    """Check all machines and wait for those that compile kernels.

    Args:
        machines: machines of the cluster.
        works: check to run on each machine; it raises an `HRCError` that names the missing
            requirement.
        note: callback that receives the addresses of machines that are still compiling.

    Raises:
        ConfigError: a machine lacks the package or has another version of it, or `works` fails on
            the machine.
    """
    registrations = pack()
    asked = {
        _on(each).remote(registrations, works): each for each in machines
    }  # one task per machine
    waiting = [*asked]
    while waiting:
        done, waiting = ray.wait(waiting, timeout=20)
        if not done:
            where = ", ".join(sorted({asked[each].address for each in waiting}))
            note(
                f"Waiting for {where}: kernels are compiled there, which happens only once. {SETUP}"
            )
        for each in done:
            _check_answer(each, asked[each])


SETUP = "To compile them in advance, run `python -m hrc_env setup` on each machine or in its image."


def _on(machine: Machine) -> Any:
    """Return the function `_describe` as a Ray task that runs on the given machine."""
    where = NodeAffinitySchedulingStrategy(machine.id, soft=False)
    return ray.remote(_describe).options(scheduling_strategy=where, num_cpus=0, max_retries=1)


def _describe(registrations: Registrations, works: Callable[[], None] | None) -> str:
    """Check this machine and return the version of this package on it."""
    with plain_errors():
        registrations.unpack()
        if works is not None:
            works()
    return VERSION


def _check_answer(answer: Any, machine: Machine) -> None:
    """Raise `ConfigError` if a machine failed its check or has another version of the package."""
    try:
        theirs = ray.get(answer)
    except RayError as error:
        raise ConfigError(f"Machine {machine.address} cannot work: {reason_of(error)}") from error
    if theirs != VERSION:
        raise ConfigError(
            f"Machine {machine.address} has hrc_env {theirs}, but this one has {VERSION}: all must "
            "have the same version."
        )


def reason_of(error: BaseException) -> str:
    """Return the message of an error that a worker raised."""
    cause: Any = getattr(error, "cause", None) if isinstance(error, RayTaskError) else None
    found = cause if isinstance(cause, BaseException) else error
    while isinstance(found, RayTaskError) and isinstance(found.cause, BaseException):
        found = found.cause
    said = str(found).strip()
    missing = "No module named "
    if missing in said:
        name = said.rpartition(missing)[2].split("'")[1]
        package = name.partition(".")[0]
        remedy = (
            f'pip install "hrc_env[ray]=={VERSION}" there, in the same Python environment'
            if package == "hrc_env"
            else "install it there, or pass a Python file with --import, which is sent to all "
            "machines"
        )
        return f"it cannot import {name!r}: {remedy}."
    return said if isinstance(found, HRCError) else f"{type(found).__name__}: {said[-600:]}"


@contextmanager
def plain_errors() -> Iterator[None]:
    """Raise errors of this package without their causes, which may fail to unpickle elsewhere."""
    try:
        yield
    except HRCError as error:
        raise type(error)(str(error)) from None


def one_core() -> None:
    """Restrict the computations of this worker process to one core."""
    os.environ[CORES] = "1"
