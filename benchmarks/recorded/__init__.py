"""Evaluation of estimators on recorded films, for which there is no ground truth."""
