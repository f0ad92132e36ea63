"""The change of the reference that makes a walk the record."""
