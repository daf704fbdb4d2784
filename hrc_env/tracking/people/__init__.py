"""Whose is which detection, where there are several workers."""
