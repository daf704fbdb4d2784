"""Agents: one file each. An agent turns observations (..., n) into actions (..., A).

What they know beforehand is the robot and how to read an observation (`env_info.EnvInfo`); what
they know of a worker is the estimate in the observation.
"""
