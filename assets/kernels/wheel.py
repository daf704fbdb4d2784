"""Build a wheel that contains compiled kernels: python -m assets.kernels.wheel.

The wheel is for Linux on x86-64 processors with AVX2 and for the version of Python that builds it.
With the versions of numba and llvmlite that are installed here, nothing is compiled after its
installation; with others, kernels are compiled as usual. A wheel of pure Python, for every other
machine, is built beside it.
"""

import os
import platform
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console

from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import ahead, cache, lean
from hrc_env.core.progress import progress_bar

ROOT = Path(__file__).resolve().parents[2]
KERNELS = "HRC_ENV_KERNELS"
"""Name of the environment variable from which `hatch_build.py` takes the folder of kernels."""


@dataclass(frozen=True, kw_only=True)
class Wheel:
    """Compile all kernels that are recorded, and build two wheels."""

    out: Path = Path("out/wheel")
    """Folder for the wheels."""

    def run(self) -> None:
        """Build the wheels.

        Raises:
            ConfigError: this machine compiles no kernels for x86-64-v3, or not all were compiled.
        """
        generator = lean._lean_context().codegen()
        if sys.platform != "linux" or not isinstance(generator, lean.PortableCodegen):
            raise ConfigError(
                "A wheel with kernels needs Linux and an x86-64 processor with AVX2, and none of "
                f"numba's settings of the processor; this is {platform.platform()}."
            )
        with tempfile.TemporaryDirectory() as folder:
            kernels = self._compile(Path(folder))
            build_wheel(self.out)
            build_wheel(self.out, kernels)

    def _compile(self, folder: Path) -> Path:
        """Compile all kernels into a folder, and return the folder of their files."""
        os.environ["NUMBA_CACHE_DIR"] = str(folder)
        cache.folder.cache_clear()
        shutil.rmtree(cache.DISTRIBUTED, ignore_errors=True)
        with progress_bar(Console(), "kernels") as say:
            ahead.compile_missing(None, say)
        if left := ahead.missing():
            raise ConfigError(f"Kernels that were not compiled: {[each.kernel for each in left]}.")
        return cache.folder()


def build_wheel(out: Path, kernels: Path | None = None) -> None:
    """Build a wheel of the package in a folder.

    Args:
        out: folder of the wheel.
        kernels: folder of compiled kernels that the wheel contains; None for pure Python.
    """
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", str(ROOT)]
    variables = {} if kernels is None else {KERNELS: str(kernels)}
    subprocess.run([*command, "-w", str(out)], env={**os.environ, **variables}, check=True)


if __name__ == "__main__":
    tyro.cli(Wheel, description=__doc__).run()
