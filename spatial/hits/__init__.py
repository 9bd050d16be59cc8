"""Maps of hits: tiles of cells that hold mean hit points and normals, many maps over one pool, scans drawn in."""
