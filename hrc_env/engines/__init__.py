"""Engines, which compute the parts of an experiment: this process, others, or Ray."""
