"""Estimation of each worker's joints from the 2D keypoints of several cameras."""
