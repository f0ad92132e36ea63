"""Accuracy over versions: walks compared, figures over commits, and the pytest plug-in."""
