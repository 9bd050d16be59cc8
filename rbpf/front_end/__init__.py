"""Every scan against a local map of the last few metres: prediction, tracking, motion between keyframes."""
