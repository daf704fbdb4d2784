"""Tasks: what the robot is to achieve. One file per task; none of them reads a camera."""
