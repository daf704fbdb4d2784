"""The cost of perception at an equal rate of contacts, reached by the margin of each setup."""
