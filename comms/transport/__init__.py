"""What carries bytes between robots: Zenoh, a network in memory, and the link to the own drivers."""
