"""Geometry in NumPy and numba: rotations, cameras, chains, distances, triangulation."""
