"""The makers of the robots' models."""
