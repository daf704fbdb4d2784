"""The benchmark of rare events."""
