"""Benchmarks: what the product costs and how right it is. Each script says at its head how it is called."""
