"""Benchmarks of estimators, detector, speed and motion, which write tables and results.json."""
