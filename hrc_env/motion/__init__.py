"""Simulation of the workers' motion, from behaviour and activities to 22 body segments."""
