"""Ablations of rigs, detections and estimators: what the paper leaves open."""
