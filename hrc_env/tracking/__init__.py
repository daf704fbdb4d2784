"""Tracking: from the 2D keypoints of several cameras to a belief about each worker's joints."""
