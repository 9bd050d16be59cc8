"""Drives of one building on different days as one map: what was seen later wins, and what changed is named."""
