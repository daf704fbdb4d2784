"""Experiments: what the package can do, measured against ground truth and theory."""
