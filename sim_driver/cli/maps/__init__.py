"""Commands on logs and map files: map, align, merge."""
