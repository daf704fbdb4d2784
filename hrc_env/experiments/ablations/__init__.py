"""Ablations of rigs, detections and estimators, for questions that the paper leaves open."""
