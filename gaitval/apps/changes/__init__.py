"""Two sessions of one person, before and after: what changed, and whether re-measuring would."""
