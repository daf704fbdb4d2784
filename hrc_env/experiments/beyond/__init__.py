"""Beyond the paper: rigs, estimators and their parts, one question at a time."""
