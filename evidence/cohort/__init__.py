"""Measurements that write `reports/evidence/cohort.csv`."""
