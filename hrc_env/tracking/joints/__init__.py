"""One Gaussian particle filter for each joint."""
