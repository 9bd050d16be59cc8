"""Keys and certificates of a closed team, and who may write under which name."""
