"""What a person can wear: devices as tables, their masses, and how they are drawn."""
