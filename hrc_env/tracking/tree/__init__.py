"""The stages of the default estimator, in which Gaussians on a kinematic tree represent a body."""
