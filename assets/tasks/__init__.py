"""The makers of what tasks put beside the robot."""
