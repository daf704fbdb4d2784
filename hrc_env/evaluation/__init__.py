"""Play agents, summarize their episodes, and give every number its confidence interval."""
