"""Experiments that compare perception, estimators and policies with the ground truth."""

from hrc_env.experiments import columns as columns
