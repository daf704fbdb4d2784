"""How one row comes about: a policy, a pair of eyes, the same seeds; what is kept of episodes."""
