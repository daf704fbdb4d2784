"""Build hook that adds compiled kernels to a wheel: python -m assets.kernels.wheel.

Without the variable HRC_ENV_KERNELS, the wheel is one of pure Python, for every machine.
"""

import os
import sys
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

KERNELS = "HRC_ENV_KERNELS"
"""Name of the environment variable for the folder of the kernels to add."""
PLATFORM = "manylinux_2_17_x86_64"
"""Platform of the kernels; they link to nothing but the C library's mathematical functions."""


class KernelsHook(BuildHookInterface):  # type: ignore[type-arg]
    """Adds the kernels and the tag of the Python version and platform for which they are."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Change the contents and the tag of a wheel before it is built."""
        folder = os.environ.get(KERNELS)
        if folder and version == "standard":
            build_data["force_include"][folder] = "hrc_env/core/kernels/compiled"
            build_data["pure_python"] = False
            build_data["tag"] = f"cp{sys.version_info[0]}{sys.version_info[1]}-none-{PLATFORM}"
