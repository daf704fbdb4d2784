"""From 2D keypoints of several cameras to a belief about the worker's joints."""
