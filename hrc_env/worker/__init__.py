"""Bodies of workers: measurements, surfaces, and props in the hands."""
