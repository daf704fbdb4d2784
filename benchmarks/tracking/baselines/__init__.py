"""Other libraries on the sequences of the tracking benchmark."""
