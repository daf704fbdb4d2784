"""Where a result comes from: versions, commit, machine. Written beside every result."""

import os
import platform
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = ("numpy", "numba", "mujoco", "gymnasium", "stable-baselines3", "torch",
            "opencv-python-headless", "ai-edge-litert")  # fmt: skip


def provenance() -> dict[str, Any]:
    """Versions, the checkout's commit (if it is one) and the machine."""
    return {
        "hrc_env": _version("hrc_env"),
        "git": _commit(),
        "versions": {name: _version(name) for name in PACKAGES},
        "machine": {
            "python": sys.version.split()[0],
            "system": platform.platform(),
            "cores": os.cpu_count(),
        },
    }


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _commit() -> str | None:
    """The commit, with "+changes" where the working tree differs; None outside a checkout."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return None
    try:
        commit = _git(root, "rev-parse", "--short", "HEAD")
        return commit + ("+changes" if _git(root, "status", "--porcelain") else "")
    except (OSError, subprocess.CalledProcessError):
        return None


def _git(root: Path, *words: str) -> str:
    done = subprocess.run(
        ["git", "-C", str(root), *words], capture_output=True, text=True, check=True
    )
    return done.stdout.strip()
