"""Every figure of the paper from our own data: `python -m experiments.paper.figures`."""
