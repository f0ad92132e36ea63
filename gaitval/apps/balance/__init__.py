"""Balance as people keep it: pushes, slips, trips and steps down, beside measured recoveries."""
