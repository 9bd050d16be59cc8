"""Mission files, settings, seeds, and the folder that a run leaves."""
