"""A subject's run: its stages, Algorithm 1, stored baselines."""
