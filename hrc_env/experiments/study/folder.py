"""The folder of an experiment: whose results it holds, and that nobody else's are overwritten."""

import json
import shutil
from pathlib import Path

from hrc_env.core.errors import ConfigError
from hrc_env.core.results import write_whole

LABEL = "experiment.json"
"""Says whose folder it is."""


def claim(out: Path, experiment: str, overwrite: bool = False) -> None:
    """Make `out` the folder of an experiment.

    What an earlier run of the same experiment finished there stays and is used.

    Args:
        out: a folder, made if it is not there.
        experiment: name.
        overwrite: throw away what somebody else left there.

    Raises:
        ConfigError: it is a file, or holds the results of something else.
        HRCError: it cannot be written.
    """
    if out.exists() and not out.is_dir():
        raise ConfigError(f"--out must be a folder; {out} is a file.")
    owner = owner_of(out)
    if owner not in (None, experiment):
        if not overwrite:
            raise ConfigError(
                f"{out} holds the results of {owner!r}; this is {experiment!r}. Choose another "
                "--out, or give --overwrite to throw those away."
            )
        for name in ("parts", "figures"):
            shutil.rmtree(out / name, ignore_errors=True)
        (out / "results.json").unlink(missing_ok=True)
    write_whole(out / LABEL, json.dumps({"experiment": experiment}))


def owner_of(out: Path) -> str | None:
    """Whose results a folder holds; None: nobody's. Half-written files have no owner that
    anybody could read: "something unreadable"."""
    label, results = out / LABEL, out / "results.json"
    for path in (label, results):
        if path.exists():
            try:
                content = json.loads(path.read_text())
                return str(content["experiment"] if path == label else "another benchmark")
            except (json.JSONDecodeError, KeyError, TypeError):
                return f"something unreadable ({path.name})"
    return None
