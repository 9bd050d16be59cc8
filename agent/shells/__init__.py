"""What runs the core: the process shell, the virtual-time shell, and what both share."""
