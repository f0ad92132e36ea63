"""Figures and the HTML and PDF report of a run folder."""
