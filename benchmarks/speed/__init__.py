"""The speed benchmark: steps per second of whole environments, and times of the parts of a step."""
