"""The speed benchmark: steps a second of whole environments, and the share of each part of a
step."""
