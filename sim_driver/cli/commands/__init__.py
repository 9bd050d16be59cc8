"""Every sub-command: its arguments, its options and its help."""
