"""The tracking bench: every estimator on the same sequences, beside the bound."""
