"""What is played: settings, walks, eyes on them, sums of what was believed."""
