"""Mutants of merge/grids."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "merge/grids/agreement.py",
        "            against += 1",
        "            agree += 1",
        "contradicting maps seem to agree",
    ),
    Mutant(
        "merge/grids/fuse_kernels.py",
        "                out[i, j] = a + b",
        "                out[i, j] = min(a, b)",
        "one robot's glimpse of a free cell clears another's wall",
    ),
    Mutant(
        "merge/grids/fusion_tree.py",
        "            del self._made_of[index], self.cells[index], self.known_cells[index]\n",
        "",
        "an unmerged map stays in the team map",
    ),
    Mutant(
        "merge/grids/fusion_tree.py",
        "            if self._made_of.get(index) == versions:",
        "            if index in self._made_of:",
        "the team map does not follow maps that change",
    ),
    Mutant(
        "merge/grids/layers.py",
        "        before = self._tiled if same_place else None",
        "        before = self._tiled",
        "a map that is placed anew stays where it was in the team map",
    ),
    Mutant(
        "merge/grids/warp_kernels.py",
        "    if value >= OCCUPIED and draws_thin and not is_thick(cells, r, c):\n"
        "        return _beside(cells, r, c, sx - c - 0.5, sy - r - 0.5)\n",
        "",
        "thin walls get thick in the team map",
    ),
    Mutant(
        "merge/grids/tiled_grid.py",
        "        if self.resolution_m != other.resolution_m:\n            return False\n",
        "",
        "a map whose cells are of another size now is laid as before",
    ),
    Mutant(
        "merge/grids/tiled_grid.py",
        "return cls(tiles, edge_m, (x - col0 * edge_m, y - row0 * edge_m))",
        "return cls(tiles, edge_m)",
        "a map file whose origin is between cells is laid up to half a cell off",
    ),
    Mutant(
        "merge/grids/tiled_grid.py",
        "if tile.known_cells}",
        "}",
        "tiles that left a map take up room in the team map",
    ),
    Mutant(
        "merge/grids/published_map.py",
        "before.tiles == after.tiles",
        "before.tiles.keys() == after.tiles.keys()",
        "what a robot sees on ground that it knows stays out of the team map",
    ),
    Mutant(
        "merge/grids/warp.py",
        "MARGIN_CELLS = 6",
        "MARGIN_CELLS = 0",
        "walls are torn at the edges of tiles",
    ),
    Mutant(
        "merge/grids/published_map.py",
        "before.origin_m == after.origin_m and ",
        "",
        "a map that moved in its frame is drawn where it was",
    ),
    Mutant(
        "merge/grids/agreement.py",
        "range(first >> BITS, (last >> BITS) + 1)",
        "range(first >> BITS, (first >> BITS) + 1)",
        "near a wall at a tile's edge nothing agrees on the other side of it",
    ),
    Mutant(
        "merge/grids/agreement.py",
        "[at >> 2 * BITS] * TILE_CELLS",
        "[at >> 2 * BITS] * 0",
        "all walls of a map lie in one tile",
    ),
    Mutant(
        "merge/grids/fusion_tree.py",
        "self.known_cells[index] = cells, int(np.count_nonzero(cells != UNKNOWN))",
        "self.known_cells[index] = cells, cells.size",
        "robots seem to know more than they do",
    ),
    Mutant(
        "merge/grids/tiled_grid.py",
        "slot[is_inside] = slots[tuple(tile[is_inside].T)]",
        "slot[is_inside] = 0",
        "where a robot has been is looked up in another tile",
    ),
    Mutant(
        "merge/grids/wall_kernels.py",
        "    return down and left and is_wall(cells, r - 1, c - 1)",
        "    return False",
        "one corner of every area of wall is drawn as a line",
    ),
    Mutant(
        "merge/grids/wall_kernels.py",
        "    return not (is_area and (not draws_thin or is_thick(cells, r + dr, c + dc)))",
        "    return True",
        "areas of wall are drawn over by lines",
    ),
    Mutant(
        "merge/grids/wall_kernels.py",
        "        return not (is_wall(cells, r + dr, c) or is_wall(cells, r, c + dc))",
        "        return True",
        "corners of walls are cut short",
    ),
    Mutant(
        "merge/grids/wall_kernels.py",
        "        value = value0 if gone < 0.5 * (u1 - u0) else value1",
        "        value = value0",
        "a wall's two ends have one certainty",
    ),
    Mutant(
        "merge/grids/wall_kernels.py",
        "out[row, col] < value:",
        "True:",
        "of two wall cells that fall into one the last stays, not the surer",
    ),
    Mutant(
        "merge/grids/wall_kernels.py",
        "    is_sampled = links == 0 and is_area and ratio <= SAMPLES_ALL",
        "    is_sampled = False",
        "single cells of wall get a cell wider",
    ),
    Mutant(
        "merge/grids/agreement.py",
        "        if near_m not in self._near:\n",
        "        if True:\n",
        "each map of a team is marked again for every other one that it is compared with",
    ),
    Mutant(
        "merge/grids/agreement.py",
        "self._near: dict[float, NDArray[np.uint64]] = {}",
        "self._near = dict.fromkeys((0.3, 0.15), near_walls(tiled, 0.15 / tiled.resolution_m))",
        "maps placed through others are compared as closely as those that were aligned",
    ),
    Mutant(
        "merge/grids/agreement.py",
        "float(np.cos(theta)), float(np.sin(theta))",
        "float(np.cos(theta)), float(np.sin(-theta))",
        "maps placed at an angle contradict each other, and are unmerged",
    ),
    Mutant(
        "merge/grids/fusion_tree.py",
        "        while self._kept > MOST_NODES:",
        "        while False:",
        "of a large building that many robots know what was fused takes hundreds of megabytes",
    ),
    Mutant(
        "merge/grids/fusion_tree.py",
        "            self._forget(index)\n        made = []",
        "        made = []",
        "what was fused of maps that are gone is kept for ever",
    ),
    Mutant(
        "merge/grids/agreement.py",
        "(pool >= 0) & (pool <= FREE_MAX)",
        "(pool <= FREE_MAX)",
        "walls on what is unknown contradict it",
    ),
    Mutant(
        "merge/grids/agreement.py",
        "corner = float(TILE_CELLS * col0), float(TILE_CELLS * row0)",
        "corner = 0.0, 0.0",
        "maps that lie off their origin are compared somewhere else",
    ),
    Mutant(
        "merge/grids/upright.py",
        "read_turned_map(path, key, resolution_m)",
        "read_turned_map(path, key)",
        "the resolution asked for is not heeded",
    ),
    Mutant(
        "merge/grids/upright.py",
        "read_turned_map(path, key, resolution_m)",
        "read_turned_map(path, resolution_m=resolution_m)",
        "of a pair of maps the first is aligned with itself",
    ),
)
