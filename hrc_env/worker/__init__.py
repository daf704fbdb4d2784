"""A worker's body: measures, surface, what the hands hold."""
