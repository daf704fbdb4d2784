"""Engines, which compute the parts of an experiment in this process, in others, or with Ray."""
