"""One verification for all proposals: refinement, agreement, contradiction, ambiguity, decision."""
