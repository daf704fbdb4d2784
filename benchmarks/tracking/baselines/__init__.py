"""Evaluation of other libraries on the sequences of the tracking benchmark."""
