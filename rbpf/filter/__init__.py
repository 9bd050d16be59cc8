"""The Rao-Blackwellised particle filter over keyframes: proposal, weights, resampling, trajectories."""
