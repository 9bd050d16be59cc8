"""Loop closing: places seen again, and the relaxation of a trajectory that follows."""
