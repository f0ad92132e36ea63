"""A page for each patient."""
