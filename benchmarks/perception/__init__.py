"""How fast the eyes are, how well they see, and what faults cost them."""
