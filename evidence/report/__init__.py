"""Measurements that write `reports/evidence/report.csv`."""
