"""Agents, one file each. An agent turns observations (..., n) into actions (..., A).

An agent knows the robot and the layout of observations in advance (`env_info.EnvInfo`); of workers
it knows the estimate in the observation.
"""
