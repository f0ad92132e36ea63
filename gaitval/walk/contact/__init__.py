"""Ground contact: the laws, and what they do to the feet."""
