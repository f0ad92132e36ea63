"""gaitval beside other programs, on the same input."""
