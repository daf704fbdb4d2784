"""PPO by RLlib: many processes and machines step environments, one learns."""
