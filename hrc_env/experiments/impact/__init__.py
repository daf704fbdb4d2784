"""What the eyes are worth in safety: the same robots and workers, seen in different ways."""
