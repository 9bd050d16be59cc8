"""Commands on missions and what they left: run, demo, sweep, eval, report, bag, gather."""
