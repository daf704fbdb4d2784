"""Play agents, count what came of their episodes, and say how sure the numbers are."""
