"""Subjects: their files, the built-in ones, and who they are."""
