"""What goes into a network and what comes out, whichever runtime does the sums."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Tensor: TypeAlias = NDArray[np.float32]

Network: TypeAlias = Callable[[Tensor], list[Tensor]]
"""An image (H, W, 3) -> the outputs that were asked for, copies."""
