"""The worker's motion: behaviour to activities to a control vector to 22 body segments."""
