"""Association of detections with workers, where there are several workers."""
