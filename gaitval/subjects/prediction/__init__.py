"""Gait that was not recorded, predicted from other trials and other people."""
