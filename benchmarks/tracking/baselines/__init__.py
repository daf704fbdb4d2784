"""Other people's code on the sequences of the tracking bench."""
