"""The estimators on real films, where there is no ground truth."""
