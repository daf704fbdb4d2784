"""Fit of the emulator: one module for each group of tables, estimated from samples in this
order."""
