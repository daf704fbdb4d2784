"""Estimators on recorded films, for which there is no ground truth."""
