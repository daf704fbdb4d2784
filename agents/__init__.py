"""Agents: one file each. An agent turns observations (..., n) into actions (..., A).

They use only the public doors of hrc_env, and what they know of a worker is the estimate
in the observation.
"""
