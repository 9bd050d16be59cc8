"""The team graph: edges, loops that must close, joint least squares, placements."""
