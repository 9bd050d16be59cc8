"""The methods that propose transforms: features, Hough spectrum, random walks, exhaustive search."""
