"""Compiled kernels on disk that fit the sources, or none.

numba keeps a compiled kernel until its own file changes. It does not see that another file's
kernel changed which was built into it; what is left then runs old arithmetic, or reads arrays in
an order that has gone. After an upgrade, a `git pull` or an edit all kernels are therefore
compiled anew.
"""

import hashlib
import os
from pathlib import Path

KERNELS = ("*.nbi", "*.nbc")
"""numba's index and code files."""


def forget_stale(package: Path) -> bool:
    """Delete the package's compiled kernels if any of its sources is another than at their time.

    Returns:
        Whether the sources had changed. Where nothing can be written nothing was kept either.
    """
    sources = sorted(package.rglob("*.py"))
    now = _digest(package, sources)
    stamp = _stamp(package)
    if stamp.exists() and stamp.read_text() == now:
        return False
    try:
        for folder in {_kept_in(source.parent) for source in sources}:
            for kernel in (path for pattern in KERNELS for path in folder.glob(pattern)):
                kernel.unlink(missing_ok=True)
        stamp.parent.mkdir(parents=True, exist_ok=True)
        draft = stamp.with_suffix(f".{os.getpid()}")
        draft.write_text(now)
        draft.replace(stamp)
    except OSError:  # a read-only installation: it changes as a whole, which numba does see
        pass
    return True


def _digest(package: Path, sources: list[Path]) -> str:
    """Of names and contents of the sources that hold kernels."""
    digest = hashlib.sha256()
    for source in sources:
        text = source.read_bytes()
        if b"numba.njit" in text:
            digest.update(str(source.relative_to(package)).encode())
            digest.update(text)
    return digest.hexdigest()


def _kept_in(folder: Path) -> Path:
    """Where numba keeps the kernels of a folder's sources."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if not chosen:
        return folder / "__pycache__"
    name = hashlib.sha1(str(folder).encode(), usedforsecurity=False).hexdigest()
    return Path(chosen) / f"{folder.name}_{name}"


def _stamp(package: Path) -> Path:
    return _kept_in(package) / "kernels.stamp"
