"""The fit of the emulator: tables of errors from samples, one after the other."""
