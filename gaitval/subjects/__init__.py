"""Subjects: their files, the built-in ones, tables of curves, and gait that is predicted from other
trials and other people.
"""
