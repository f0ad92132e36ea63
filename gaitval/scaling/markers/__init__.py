"""Marker sets drafted from names, and a pelvis without markers on its anterior spines."""
