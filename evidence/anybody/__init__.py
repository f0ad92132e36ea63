"""Measurements that write `reports/evidence/anybody.csv`."""
