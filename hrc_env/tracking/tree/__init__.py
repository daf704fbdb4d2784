"""A whole body as one Gaussian on the kinematic tree."""
