"""Bodies of robots: simulated in one true world, or fed from a recorded log."""
