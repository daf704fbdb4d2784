"""The tracking benchmark: every estimator on the same sequences, compared with the bound."""
