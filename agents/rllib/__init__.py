"""PPO by RLlib, with environments in several processes or machines and a single learner."""
