"""The perception levels that have cameras: predict, look, update."""
