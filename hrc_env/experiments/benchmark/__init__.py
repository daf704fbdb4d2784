"""The benchmark: what a policy is worth, and how safe it is, under fixed conditions and seeds."""
