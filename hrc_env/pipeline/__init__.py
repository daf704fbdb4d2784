"""Pipelines of the perception levels: they predict, detect and update the estimates of workers."""
