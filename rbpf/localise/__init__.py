"""A robot's pose in a map that does not change: scans matched to it, without particles and without drawing."""
