"""PPO by RLlib, with environments on many processes and machines, and a single learner."""
