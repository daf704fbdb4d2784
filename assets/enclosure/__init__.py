"""Fit of the capsules that enclose a person with 15 known joints."""
