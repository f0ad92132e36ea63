"""Reports and figures of a study and of a session."""
