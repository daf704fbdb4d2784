"""The effect of perception on safety: the same robots and workers with different perception."""
