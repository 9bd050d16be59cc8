"""Worlds, simulated and recorded robots, missions, and the command ``mrslam``: the top floor."""
