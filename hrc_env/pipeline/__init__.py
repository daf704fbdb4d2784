"""Pipelines of the perception levels, which predict, detect and update estimates of workers."""
