"""Mutants of spatial."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "spatial/files/saved_map.py",
        '        if hashlib.sha256(part).hexdigest() != manifest["sha256"].get(name):\n',
        "        if False:\n",
        "a saved map with a part of another one is read",
    ),
    Mutant(
        "spatial/files/saved_map.py",
        "    if number > FORMAT:\n",
        "    if False:\n",
        "a saved map of a newer program is read as if it were an old one",
    ),
    Mutant(
        "spatial/hits/store.py",
        "        above, left = self.row0 % side, self.col0 % side",
        "        above, left = 0, 0",
        "walls that are new are not published",
    ),
    Mutant(
        "spatial/se2.py",
        "x = -cos * ab[..., 0] - sin * ab[..., 1]",
        "x = -cos * ab[..., 0] + sin * ab[..., 1]",
        "inverse transforms are wrong wherever something is turned",
    ),
    Mutant(
        "spatial/se2.py",
        "return _columns(x, y, wrap(ab[..., 2] + bc[..., 2]))",
        "return _columns(x, y, ab[..., 2] + bc[..., 2])",
        "headings grow beyond a turn, and differences of them are wrong",
    ),
    Mutant(
        "spatial/se2.py",
        "theta = float(np.arctan2(cross[0, 1] - cross[1, 0], cross[0, 0] + cross[1, 1]))",
        "theta = float(np.arctan2(cross[1, 0] - cross[0, 1], cross[0, 0] + cross[1, 1]))",
        "fitted trajectories and maps are turned the wrong way",
    ),
    Mutant(
        "spatial/poses.py",
        "out[1] = -s * dx + c * dy",
        "out[1] = s * dx + c * dy",
        "odometry between two scans is mirrored in the mapper",
    ),
    Mutant(
        "spatial/grid.py",
        "return (np.stack([cols, rows], axis=-1) + 0.5) * self.resolution_m",
        "return np.stack([cols, rows], axis=-1) * self.resolution_m",
        "walls lie half a cell off in all that works with points",
    ),
    Mutant(
        "spatial/grid.py",
        "x = self.origin_m[0] + (c0 - margin_cells) * self.resolution_m",
        "x = self.origin_m[0] + c0 * self.resolution_m",
        "a map that is cropped with a margin moves",
    ),
    Mutant(
        "spatial/grid.py",
        "OCCUPIED_MIN = 65",
        "OCCUPIED_MIN = 101",
        "no map has a wall",
    ),
    Mutant(
        "spatial/tiles.py",
        "if self.tiles[index].revision > revision}",
        "if self.tiles[index].revision >= revision}",
        "every exchange sends what the peer has already",
    ),
    Mutant(
        "spatial/tiles.py",
        "r0, c0 = i * TILE_CELLS - row0, j * TILE_CELLS - col0",
        "r0, c0 = i * TILE_CELLS - row0, j * TILE_CELLS - col0 + 1",
        "a grid made into tiles is shifted by a cell",
    ),
    Mutant(
        "spatial/scan.py",
        "ranges[ranges > self.range_max_m] = np.inf",
        "ranges[ranges > self.range_max_m] = self.range_max_m",
        "beams that hit nothing draw walls at the end of the range",
    ),
    Mutant(
        "spatial/scan.py",
        "dropped = ~(ranges > 0.0) | (ranges < self.range_min_m)",
        "dropped = ~(ranges > 0.0)",
        "readings that the driver marks as errors become walls beside the robot",
    ),
    Mutant(
        "spatial/scan.py",
        "            beam_interval_s=self.beam_interval_s,\n        )",
        "        )",
        "a masked scan of a moving robot is not straightened",
    ),
    Mutant(
        "spatial/traversal.py",
        "return step, ((cell + 1 - start) if way > 0 else (start - cell)) * between, between",
        "return step, ((cell + 1 - start) if way > 0 else (cell + 1 - start)) * between, between",
        "beams towards smaller coordinates clear the wrong cells",
    ),
    Mutant(
        "spatial/distance.py",
        "                near = min(near, out[r, c + 1] + 1)\n            out[r, c] = near\n    return out",
        "                near = min(near, out[r, c + 1] + 2)\n            out[r, c] = near\n    return out",
        "the dissimilarity of maps is wrong to one side",
    ),
    Mutant(
        "spatial/distance.py",
        "column[r, c] = min(column[r, c], gap)",
        "column[r, c] = gap",
        "distances to walls below are not seen",
    ),
    Mutant(
        "spatial/files/atomic.py",
        "        part.replace(path)",
        '        path.write_bytes(b"".join(pieces))\n        part.unlink()',
        "a crash while writing leaves half a map or checkpoint",
    ),
    Mutant(
        "spatial/files/atomic.py",
        "fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)",
        "fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)",
        "two runs write into one folder",
    ),
    Mutant(
        "spatial/files/state_file.py",
        "if hashlib.sha256(body).hexdigest().encode() != parts[2]:",
        "if not body:",
        "a damaged checkpoint is taken up",
    ),
    Mutant(
        "spatial/files/trinary.py",
        "return np.ascontiguousarray(image[::-1])",
        "return np.ascontiguousarray(image)",
        "maps are written upside down",
    ),
    Mutant(
        "spatial/files/tum.py",
        "theta = np.arctan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))",
        "theta = np.arctan2(2 * (qw * qz - qx * qy), 1 - 2 * (qy * qy + qz * qz))",
        "trajectories of other tools with a slope are read with a wrong heading",
    ),
    Mutant(
        "spatial/runtime/spool.py",
        "            while self._waiting:\n                self._write(self._waiting[0])",
        "            while self._waiting:\n                self._write(self._waiting[-1])",
        "after a full disk the rows of a log are in the wrong order",
    ),
    Mutant(
        "spatial/matching/places.py",
        " and found.inliers >= (AGREEING_LEAST + 0.5 * more) * seen",
        "",
        "a loop is closed where walls contradict",
    ),
    Mutant(
        "spatial/matching/places.py",
        "        found = searched if searched.score > descended.score else descended",
        "        found = descended",
        "places that drift has put a metre away are not seen again",
    ),
    Mutant(
        "spatial/matching/places.py",
        " + np.diag(EDGE_SIGMA**2)",
        "",
        "an edge is believed to micrometres, and nothing can correct it",
    ),
    Mutant(
        "spatial/files/map_files.py",
        "return _grid(path, cells, resolution, (0.0, 0.0)), se2.transform(x, y, yaw)",
        "return _grid(path, cells, resolution, (0.0, 0.0)), se2.transform(x, y, 0.0)",
        "the yaw of a map file is not heeded",
    ),
)
