"""Many studies, and one report of all."""
