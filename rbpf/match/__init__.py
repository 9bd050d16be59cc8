"""Scan matching: points with normals from ranges, nearest surfaces, Gauss-Newton descent, correlative search."""
