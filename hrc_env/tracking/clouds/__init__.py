"""Clouds of particles: the parts of the paper's Algorithm 1."""
