"""Shields, constraints, costs and incidents: the safety of people near the robot."""
