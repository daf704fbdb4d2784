"""Cameras as they are: lenses, makes of camera, rigs in files."""
