"""The import's warnings: what physics, or everybody's walking, says against a recording."""
