"""A kernel's digest changes with what the kernel computes, and with nothing else."""

import numpy as np
import pytest

from hrc_env.core.kernels import kernel
from hrc_env.core.kernels.digest import digest_of

PLAIN = """
FACTOR = 2.0
TABLE = np.array([1.0, 2.0])
@kernel
def callee(x):
    return 0.5 * (FACTOR * x)
@kernel
def caller(x):
    return callee(x) + TABLE[0]
"""


def digest(source: str, name: str = "caller", module: str = __name__) -> str:
    scope = {"np": np, "kernel": kernel, "__name__": module}
    exec(source, scope)
    return digest_of(scope[name])


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("FACTOR * x", "FACTOR + x"),
        ("FACTOR = 2.0", "FACTOR = 2.5"),
        ("2.0])", "2.5])"),
        ("+ TABLE", "- TABLE"),
        ("@kernel\ndef callee", "@kernel(makes_arrays=True)\ndef callee"),
        ("@kernel\ndef callee", "@kernel(fastmath={'reassoc'})\ndef callee"),
    ],
)
def test_it_changes_with_code_constants_and_options_of_whatever_is_called(before, after):
    assert before in PLAIN
    assert digest(PLAIN.replace(before, after)) != digest(PLAIN)


def test_it_changes_with_the_module():
    """A compiled kernel looks for the modules of what it calls under the names they had."""
    assert digest(PLAIN, module="moved") != digest(PLAIN)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("FACTOR = 2.0", "# a comment\n\nFACTOR = 4.0 / 2"),
        ("def caller(x):", 'def caller(x):\n    """What it does."""'),
        ("def callee(x):", 'def callee(x):\n    """What it does."""'),
        ("FACTOR = 2.0", "FACTOR = 2.0\nOTHER = 7.0"),
    ],
)
def test_it_stays_with_comments_places_and_what_is_not_named(before, after):
    assert before in PLAIN
    assert digest(PLAIN.replace(before, after)) == digest(PLAIN)


def test_it_is_the_same_in_every_process(process):
    program = (
        "import hrc_env.simulation\n"
        "from hrc_env.core.kernels import KERNELS\n"
        "from hrc_env.core.kernels.digest import digest_of\n"
        "print(sorted((name, digest_of(each)) for name, each in KERNELS.items()))"
    )
    told = [process("-c", program, PYTHONHASHSEED=seed).stdout for seed in ("1", "2")]
    assert told[0] == told[1]
    assert told[0].count("hrc_env.") > 100
