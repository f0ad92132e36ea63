"""What commands share: their root, options, tables, live view and signals."""
