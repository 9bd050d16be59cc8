"""Merging a set of maps at once: which pairs to align, and which maps belong together."""
