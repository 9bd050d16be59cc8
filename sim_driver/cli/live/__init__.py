"""Commands on robots that are running: agent, feed, top, keys, doctor."""
