"""The process of a policy: it receives observations and answers with actions (`separate`).

    python -m hrc_env.agents.serving FILE_DESCRIPTOR

The process contains no environment. Its working directory holds the policy's files.
"""

import pickle
import socket
import sys
import traceback
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.agents.env_info import Agent
from hrc_env.agents.messages import (
    ACTION_KINDS,
    EndedError,
    receive_bytes,
    receive_header,
    receive_observation,
    send,
)
from hrc_env.agents.registry import make_agent
from hrc_env.core.errors import HRCError

MOST_CHARACTERS = 2000
"""Maximum length of the text of an error that is sent."""


def serve(judge: socket.socket) -> None:
    """Make the agent of the first message, and answer observations until the connection ends."""
    try:
        agent = _make(judge)
        send(judge, {"made": True})
        while True:
            terms = receive_header(judge)["terms"]
            action = _convert(agent.act(receive_observation(judge, terms)))
            send(judge, {"kind": action.dtype.str, "shape": action.shape}, action)
    except EndedError:
        return
    except Exception as error:  # of the policy; the judging process shows it
        if not isinstance(error, HRCError):
            traceback.print_exc()
        text = f"{type(error).__name__}: {error}"
        send(judge, {"error": text[:MOST_CHARACTERS]})


def _make(judge: socket.socket) -> Agent:
    """Return the agent that is described by the first message of the judging process."""
    header: dict[str, Any] = receive_header(judge)
    env_info = pickle.loads(receive_bytes(judge, header["env_info"]))
    return make_agent(header["policy"], env_info, header["seed"], header["trust"])


def _convert(action: Any) -> NDArray[Any]:
    """Return actions as an array of a data type that may be sent."""
    array = np.asarray(action)
    return array if array.dtype.str in ACTION_KINDS else array.astype(np.float64)


if __name__ == "__main__":
    serve(socket.socket(fileno=int(sys.argv[1])))
