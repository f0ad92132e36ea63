"""Subjects and their recorded gait, in the project's convention from here on."""
