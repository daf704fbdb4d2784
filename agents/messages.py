"""Messages between a judging process and the process of a policy: a header in JSON, and bytes.

The judging process unpickles nothing that it receives.
"""

import json
import socket
import time
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

MOST_HEADER_BYTES = 1 << 16
LENGTH_BYTES = 4
"""Size of the number in front of a header, its length in bytes (most significant byte first)."""
ACTION_KINDS = ("<f4", "<f8")
"""Data types of actions; a policy's process converts all others to float64."""


class EndedError(Exception):
    """The other process has closed the connection."""


class Term(NamedTuple):
    """The description of an array in a header."""

    name: str
    """Name of the array in an observation; "" if the observation is this array."""
    kind: str
    """Data type in NumPy's notation, such as "<f4"."""
    shape: tuple[int, ...]

    @property
    def n_bytes(self) -> int:
        """Size of the array [bytes]."""
        return int(np.prod(self.shape, dtype=np.int64)) * np.dtype(self.kind).itemsize


def send(to: socket.socket, header: Mapping[str, Any], *parts: bytes | NDArray[Any]) -> None:
    """Send a header and the bytes of some parts.

    Raises:
        EndedError: the other process has closed the connection.
        TimeoutError: it takes longer than the timeout of the socket.
    """
    text = json.dumps(header).encode()
    try:
        to.sendall(len(text).to_bytes(LENGTH_BYTES, "big") + text)
        for part in parts:
            to.sendall(part if isinstance(part, bytes) else np.ascontiguousarray(part).data)
    except (BrokenPipeError, ConnectionResetError) as error:
        raise EndedError from error


def receive_header(of: socket.socket, end_s: float | None = None) -> dict[str, Any]:
    """Receive a header.

    Args:
        of: the connection.
        end_s: time on the monotonic clock until which the header must have arrived [s]; None to
            wait without limit.

    Raises:
        EndedError: the other process has closed the connection.
        TimeoutError: the header is late.
        ValueError: it is too long, or is not a JSON object.
    """
    length = int.from_bytes(receive_bytes(of, LENGTH_BYTES, end_s), "big")
    if length > MOST_HEADER_BYTES:
        raise ValueError(f"a header of {length:,} bytes; at most {MOST_HEADER_BYTES:,} are allowed")
    try:
        header = json.loads(receive_bytes(of, length, end_s))
    except RecursionError as error:
        raise ValueError("a header that is nested too deeply") from error
    if not isinstance(header, dict):
        raise ValueError(f"a header that is no JSON object but {type(header).__name__}")
    return header


def receive_bytes(of: socket.socket, n: int, end_s: float | None = None) -> bytearray:
    """Receive `n` bytes; arguments and errors are those of `receive_header`."""
    found = bytearray(n)
    view, done = memoryview(found), 0
    while done < n:
        if end_s is not None:
            left_s = end_s - time.monotonic()
            if left_s <= 0:
                raise TimeoutError
            of.settimeout(left_s)
        try:
            received = of.recv_into(view[done:])
        except ConnectionResetError as error:
            raise EndedError from error
        if not received:
            raise EndedError
        done += received
    return found


def describe_observation(
    observation: NDArray[Any] | Mapping[str, NDArray[Any]],
) -> dict[str, list[Term]]:
    """Return the header of an observation; its arrays follow in this order."""
    arrays = observation if isinstance(observation, Mapping) else {"": observation}
    return {"terms": [Term(name, each.dtype.str, each.shape) for name, each in arrays.items()]}


def receive_observation(
    of: socket.socket, terms: Sequence[Sequence[Any]]
) -> NDArray[Any] | dict[str, NDArray[Any]]:
    """Receive the arrays of an observation after its header."""
    arrays: dict[str, NDArray[Any]] = {}
    for term in (Term(name, kind, tuple(shape)) for name, kind, shape in terms):
        content = receive_bytes(of, term.n_bytes)
        arrays[term.name] = np.frombuffer(content, term.kind).reshape(term.shape)
    return arrays.get("", arrays)
