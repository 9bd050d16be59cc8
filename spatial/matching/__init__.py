"""Matching a scan with a map of hits: points with normals, the nearest surface, descent and search."""
