"""What filters know of any worker: how bodies move, are found, and what detectors do."""
