"""The speed bench: steps a second from end to end, and what each organ's share of a step is."""
