"""The cost of perception at one rate of contacts, each setup with the margin that it needs."""
