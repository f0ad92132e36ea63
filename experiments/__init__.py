"""What trains and compares: run as `python -m experiments.NAME`; README.md lists them."""
