"""Several robots' keyframes as one pose graph: matches between two robots' scans tie them, and bend their maps."""
