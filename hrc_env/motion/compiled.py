"""How this room compiles its arithmetic."""

import numba

compiled = numba.njit(cache=True, nogil=True, error_model="numpy")
"""Sums stay in their order: what a compiler may reorder depends on what it had compiled before, and
then the last bits of a walk would depend on that, too."""
