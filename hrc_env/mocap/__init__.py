"""Bring your own motion: files of motion capture to clips that any worker plays."""
