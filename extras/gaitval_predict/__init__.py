"""A walk at a speed or of a trial that the model was not told."""
