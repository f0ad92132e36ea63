"""A walk at a speed that was not recorded, or that is held out."""
