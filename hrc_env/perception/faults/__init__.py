"""Configurable faults of cameras, drawn from a separate random generator."""
