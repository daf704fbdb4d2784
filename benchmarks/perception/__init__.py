"""How fast the eyes are, how well they see, what faults cost them, and when they see ghosts."""
