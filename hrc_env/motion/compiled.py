"""How this room compiles its arithmetic."""

import numba

compiled = numba.njit(
    cache=True, nogil=True, error_model="numpy", fastmath={"contract", "arcp", "reassoc", "nsz"}
)
"""Fused and reordered sums are allowed; NaN and infinity keep their meaning."""
