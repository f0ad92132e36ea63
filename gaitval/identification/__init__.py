"""What the record says of the body parameters μ."""
