"""Evaluation of agents: episodes, their statistics, and confidence intervals."""
