"""mujoco is compiled and ships no stubs: its names are Any to the type checker."""

from typing import Any

def __getattr__(name: str) -> Any: ...
