"""The state of a team as messages: what a robot reports, and what a watcher knows from it."""
