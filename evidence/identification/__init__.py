"""How far identification can be trusted."""
