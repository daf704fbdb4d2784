"""Comparison of statistics of the workers' motion with measurements of people."""
