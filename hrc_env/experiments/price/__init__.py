"""What sight costs at equal safety: every pair of eyes with the shield margin that it needs."""
