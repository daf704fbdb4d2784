"""Configurable faults of cameras, sampled with a separate random generator."""
