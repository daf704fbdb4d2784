"""Comparison of the workers' motion with measurements of people, by statistics."""
