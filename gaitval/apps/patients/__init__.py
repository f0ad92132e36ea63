"""Patients of whom only joint angles are known: a stride a side, walked without training."""
