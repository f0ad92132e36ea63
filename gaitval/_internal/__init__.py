"""Foundations that are not part of the interface: files, compiled code, text."""
