"""Maps of many particles over one pool of tiles: cells, drawing scans into them, copy on write, publishing."""
