"""The benchmark of people who reach where and when they are most likely to be touched."""
