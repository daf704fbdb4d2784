"""Engines: places where the parts of an experiment are computed: this process, other processes,
Ray."""
