"""Marker sets drafted from names."""
