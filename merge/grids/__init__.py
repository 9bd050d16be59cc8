"""Grids brought together: warping, fusing, layers, the fusion tree, agreement of placed maps."""
