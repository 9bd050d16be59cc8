"""Exchanges of maps: when to have one, what to ask, what to send, what it cost."""
