"""The tracking benchmark, which runs every estimator on the same sequences."""
