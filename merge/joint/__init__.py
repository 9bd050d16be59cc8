"""Several robots' keyframes as one pose graph: what both have seen ties their ways together, and bends their maps."""
