"""The commands that want a checkout: bench and gallery."""
