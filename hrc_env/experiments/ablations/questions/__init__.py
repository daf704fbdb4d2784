"""Declarations of the ablations: rigs, faults of cameras, and estimators."""
