"""A worker's body: measures, surface and the props in the hands."""
