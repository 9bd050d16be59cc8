"""Mutants of the counts of beams in cells."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "spatial/hits/cells.py",
        "        hits, visits = (hits + 1) >> 1, (visits + 1) >> 1\n",
        "        hits, visits = HITS_CAP - 1, VISITS_CAP - 1\n",
        "walls that are seen often become half walls",
    ),
    Mutant(
        "spatial/hits/cells.py",
        "(hits_of(cell) >> 1) | ((visits >> 1) << 5)",
        "hits_of(cell) | ((visits >> 1) << 5)",
        "what went away never fades",
    ),
    Mutant(
        "spatial/hits/cells.py",
        "    return cell + 32\n",
        "    return cell\n",
        "beams clear nothing: teammates and people stay as walls",
    ),
    Mutant(
        "spatial/hits/store.py",
        "return self.stamps[self.tables[index]]",
        "return np.minimum(self.tables[index], 1).astype(np.int64)",
        "walls that are new are not published",
    ),
    Mutant(
        "spatial/hits/cells.py",
        "            take = hits <= 1\n",
        "            take = False\n",
        "a thin wall that one stray beam hit from behind faces the wrong way for ever",
    ),
    Mutant(
        "spatial/hits/store.py",
        "stamps[1 : live.size + 1] = self.stamps[live]",
        "pass",
        "walls drawn after a map has shrunk are not published",
    ),
    Mutant(
        "spatial/hits/sharing.py",
        "        refs[new] = 1\n        ledger.stamps[new] = stamp\n",
        "        refs[new] = 1\n",
        "new ground is not published",
    ),
    Mutant(
        "spatial/hits/sharing.py",
        "            ledger.stamps[old] = stamp\n",
        "",
        "what changes on known ground is not published",
    ),
    Mutant(
        "spatial/hits/store.py",
        "            self.clear(index)\n",
        "            pass\n",
        "the rolling map of a robot that was carried off takes more memory each time",
    ),
    Mutant(
        "spatial/hits/cells.py",
        "(quality == 0.0 and (nx != 0.0 or ny != 0.0))",
        "quality == 0.0",
        "a wall seen without a normal is taken to look along x",
    ),
    Mutant(
        "spatial/hits/drawing.py",
        "            keep = 1.0 - skip_m * inv / max(length, 1e-9)",
        "            keep = 1.0",
        "beams along a wall wear it away",
    ),
    Mutant(
        "spatial/hits/drawing.py",
        "                if refs[tile] != 1:\n                    tile = 0",
        "                pass",
        "one particle's beams change the maps of others",
    ),
    Mutant(
        "spatial/hits/drawing.py",
        "if tile != 0 and refs[tile] == 1:",
        "if tile != 0:",
        "one particle's hits change the maps of others",
    ),
    Mutant(
        "spatial/hits/drawing.py",
        "        x0, y0 = (ox, oy) if through else (x1, y1)",
        "        x0, y0 = (ox, oy)",
        "each scan copies all tiles that its beams pass, also where only hits are added",
    ),
    Mutant(
        "spatial/hits/drawing.py",
        "    ny = s * point[2] + c * point[3]",
        "    ny = -s * point[2] + c * point[3]",
        "normals in the map are wrong wherever the robot has turned",
    ),
    Mutant(
        "spatial/hits/drawing.py",
        "mark[tr, tc] != number and",
        "",
        "tiles are copied again and again for one scan",
    ),
    Mutant(
        "spatial/hits/store.py",
        "        self._mark = np.zeros(tables.shape[1:], dtype=np.int32)\n        self._marked = 0\n\n    def _window",
        "        self._mark = np.resize(self._mark, tables.shape[1:])\n        self._marked = 0\n\n    def _window",
        "walls are not drawn where the window grew",
    ),
    Mutant(
        "spatial/hits/store.py",
        "self.row0 if r_low - 1 >= self.row0 else",
        "self.row0 if r_low >= self.row0 else",
        "nothing matches at the lower rim of the map's window",
    ),
    Mutant(
        "spatial/hits/store.py",
        "r1 if r_high + 1 < r1 else",
        "r1 if r_high < r1 else",
        "nothing matches at the upper rim of the map's window",
    ),
    Mutant(
        "spatial/hits/store.py",
        "c1 if c_high + 1 < c1 else",
        "c1 if c_high <= c1 else",
        "a kernel writes beyond the map's window at its right rim",
    ),
    Mutant(
        "spatial/hits/store.py",
        '        self.writes = state["writes"]\n',
        "",
        "what a resumed robot draws on known ground is not published",
    ),
    Mutant(
        "spatial/hits/store.py",
        '        self.row0, self.col0 = state["window"]\n',
        '        self.col0, self.row0 = state["window"]\n',
        "a resumed robot's map lies elsewhere",
    ),
    Mutant(
        "spatial/hits/store.py",
        "        self.cover(box[0], box[1])\n",
        "",
        "hits far from the start are lost",
    ),
    Mutant(
        "spatial/hits/drawing.py",
        "        if keep > 0.0:\n",
        "        if True:\n",
        "what lies behind a laser that stands at a wall is worn away",
    ),
)
