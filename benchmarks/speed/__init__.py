"""The speed benchmark: steps a second of whole environments, and shares of their parts."""
