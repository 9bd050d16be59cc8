"""Pairs of maps: the belief about each, how one more alignment changes it, and which pair is aligned next."""
