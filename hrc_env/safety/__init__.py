"""What keeps a robot from harm between its agent and its joints."""
