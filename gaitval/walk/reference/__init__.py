"""The reference motion, its dynamic fit and its adjustment."""
