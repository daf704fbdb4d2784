"""python -m hrc_env.core.kernels.worker: compiles what it reads, a JSON line [kernel, args] each.

A process of its own, so that several compile at once and their memory goes back.
"""

import json
import sys

from hrc_env.core.kernels.signatures import decode, kernel_named


def main() -> None:
    """Answer each line when that kernel is on disk."""
    for line in sys.stdin:
        name, args = json.loads(line)
        kernel_named(name).compile(tuple(decode(each) for each in args))
        sys.stdout.write("done\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
