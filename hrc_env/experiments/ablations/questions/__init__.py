"""The questions of the ablations: rigs, faults of cameras, and estimators."""
