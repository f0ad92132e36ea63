"""Motion-capture files, force plates, marker cleaning and axes."""
