"""The default estimator by stage: a body is a Gaussian on its kinematic tree, or several."""
