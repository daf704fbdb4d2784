"""Evaluation of estimators on recorded videos without ground truth."""
