"""Benchmarks: estimators, detectors, speed, motion; each writes a table and results.json."""
