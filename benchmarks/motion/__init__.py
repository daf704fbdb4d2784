"""Similarity of the workers' activities to those of people, by statistics."""
