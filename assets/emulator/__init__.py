"""Calibration of the keypoint emulator: clips, detections of the pose network, fit and
validation."""
