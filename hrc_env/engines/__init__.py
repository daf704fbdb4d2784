"""Engines: where the parts of an experiment are played, in this process, in others, by Ray."""
