"""Experiments: what the package can do, measured against ground truth and theory."""

from hrc_env.experiments import columns as columns
