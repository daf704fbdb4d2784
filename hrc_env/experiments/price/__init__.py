"""What sight costs at one rate of contacts: every pair of eyes has the margin that it needs."""
