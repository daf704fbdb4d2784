"""Benchmarks of estimators, detectors, speed and motion; each writes a table and results.json."""
