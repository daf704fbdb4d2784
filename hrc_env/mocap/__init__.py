"""Conversion of motion-capture files to clips, for playback by workers of any size."""
