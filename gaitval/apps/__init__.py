"""Applications of the library: each a command, or a tool around one."""
