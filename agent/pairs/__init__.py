"""Pairs of maps: what is believed of each, what one more alignment changes of it, and which pair is aligned next."""
