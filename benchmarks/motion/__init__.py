"""How like people's the workers' activities are: statistics beside what was measured of people."""
