"""Virtual people: bodies whose parameters are known, walked and measured like real ones."""
