"""Files of motion capture, plates, cleaning and axes."""
