"""Faults of cameras, chosen by argument and drawn from a generator of their own."""
