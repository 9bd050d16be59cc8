"""Every scan matched to a rolling map: what comes in, prediction, tracking, motion between keyframes."""
