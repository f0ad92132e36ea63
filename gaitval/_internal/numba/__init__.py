"""Compiled code: its cache, its lanes, its threads."""
