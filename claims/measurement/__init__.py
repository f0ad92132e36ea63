"""What an import says of the measurement: faults, bands, lengths, one plate under both feet."""
