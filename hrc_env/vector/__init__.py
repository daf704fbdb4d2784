"""The vector environment and its parts."""
