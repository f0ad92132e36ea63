"""Accuracy over versions: walks checked and compared, figures over commits, the pytest plug-in."""
