"""Bodies of workers, with measurements, surfaces for rendering, and held props."""
