"""Refuse a commit with a subject that is too long for `git log --oneline` and web pages.

The command is `python -m tests.commit_subject FILE`, where FILE holds the commit's message;
`.pre-commit-config.yaml` runs it as a hook.
"""

import sys
from pathlib import Path

LONGEST = 72
"""Greatest number of characters of a subject."""


def find_fault(message: str) -> str:
    """Return the fault of a commit message, "" if there is none.

    Lines that begin with # are comments of git; an empty message is refused by git itself.
    """
    lines = [line.strip() for line in message.splitlines() if not line.startswith("#")]
    subject, *rest = "\n".join(lines).strip().split("\n")
    if len(subject) > LONGEST:
        return (
            f"The subject has {len(subject)} characters, and at most {LONGEST} are allowed: "
            f"{subject!r}. Put the reason into the body, after an empty line."
        )
    if rest and rest[0]:
        return f"An empty line must separate the subject from the body, got {rest[0]!r}."
    return ""


def main(paths: list[str]) -> int:
    """Print the fault of each file's message; return 1 if there is one."""
    faults = [fault for path in paths if (fault := find_fault(Path(path).read_text("utf-8")))]
    print(*faults, sep="\n", end="\n" if faults else "", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
