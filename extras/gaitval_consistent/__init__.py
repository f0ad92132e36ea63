"""The smallest change of motion and masses that makes a recording dynamically consistent."""
