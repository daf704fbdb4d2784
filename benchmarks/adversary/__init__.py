"""The benchmark of people with reaches at places and times at which contacts are likely."""
