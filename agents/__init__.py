"""Agents, each of which turns observations (..., n) into actions (..., A).

An agent knows the robot and the layout of observations in advance (`env_info.EnvInfo`). Its only
information about workers is the estimate in the observation.
"""
