"""Conversion of motion-capture files to clips that any worker can play."""
