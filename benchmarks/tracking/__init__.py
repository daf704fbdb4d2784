"""The tracking benchmark, which runs all estimators on the same sequences."""
