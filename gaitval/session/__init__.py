"""Import of a laboratory's session: from its files to body, motion, moments, subject and tables."""
