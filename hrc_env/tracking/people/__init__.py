"""Association of detections with workers in environments with several workers."""
