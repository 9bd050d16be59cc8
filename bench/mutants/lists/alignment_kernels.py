"""Mutants of the compiled kernels of alignment."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "alignment/kernels/settling.py",
        "counts[n, 3], counts[n, 4], counts[n, 5] = matched, opposed, against",
        "counts[n, 3], counts[n, 4], counts[n, 5] = matched, against, opposed",
        "of two hundred places those are followed that lay walls on free space",
    ),
    Mutant(
        "alignment/kernels/fit.py",
        "mx * nx + my * ny < FACES_LIKE:",
        "False:",
        "walls are laid on walls that face elsewhere",
    ),
    Mutant(
        "alignment/kernels/fit.py",
        "if dx * dx + dy * dy > reach_m * reach_m or",
        "if",
        "walls are drawn to others beyond reach",
    ),
    Mutant(
        "alignment/kernels/fit.py",
        "    weight = weight * weight\n",
        "",
        "walls far off hold the fit back",
    ),
    Mutant(
        "alignment/kernels/fit.py",
        "if used + more < MIN_POINTS:",
        "if used + more < 0:",
        "two or three points decide how maps lie",
    ),
    Mutant(
        "alignment/kernels/fit.py",
        "H[k, k] += DAMPING + RELATIVE_DAMPING * H[k, k]",
        "H[k, k] += RELATIVE_DAMPING * H[k, k]",
        "maps slide along a corridor",
    ),
    Mutant(
        "alignment/kernels/fit.py",
        "cut = min(1.0, MAX_SHIFT_M / max(length, 1e-12), MAX_TURN_RAD / max(abs(shift[2]), 1e-12))",
        "cut = 1.0",
        "a step may be longer than walls are looked for",
    ),
    Mutant(
        "alignment/kernels/fit.py",
        "            ax, ay = -(cos * mx + sin * my), -(-sin * mx + cos * my)",
        "            ax, ay = (cos * mx + sin * my), (-sin * mx + cos * my)",
        "one of the two maps pushes the wrong way",
    ),
    Mutant(
        "alignment/kernels/correlation.py",
        "if state[r, c] == 1 and near == 65535:",
        "if state[r, c] == 1:",
        "all free space counts against walls, also that beside them",
    ),
    Mutant(
        "alignment/kernels/correlation.py",
        "                out[k, r, c] = min(out[k, r, c], cap)",
        "                pass",
        "clutter outweighs clean walls where maps are looked for",
    ),
    Mutant(
        "alignment/kernels/correlation.py",
        "                dr, dc = min(dr, height - dr), min(dc, width - dc)\n",
        "",
        "one place is proposed twice, over the picture's edge",
    ),
    Mutant(
        "alignment/kernels/correlation.py",
        "if value[k] >= v:\n                        keep = False",
        "if True:\n                        keep = False",
        "a place is hidden by a worse one near it",
    ),
    Mutant(
        "alignment/kernels/correlation.py",
        "if v < row[left] or v < row[right] or v < up[c] or v < down[c]:",
        "if v < row[left] or v < row[right]:",
        "slopes are taken for places",
    ),
    Mutant(
        "alignment/kernels/walls.py",
        "if strength > ONE_SIDED:",
        "if strength > 0.0:",
        "walls between two rooms have one side",
    ),
    Mutant(
        "alignment/kernels/walls.py",
        "occupied < MIN_STRAIGHT_CELLS or spread",
        "spread",
        "specks are walls",
    ),
    Mutant(
        "alignment/kernels/walls.py",
        "or spread < STRAIGHT * (cxx + cyy)",
        "",
        "a heap is a wall with two sides",
    ),
    Mutant(
        "alignment/kernels/agreement.py",
        "                and not ends_behind(state_t, x - x0, y - y0, nx, ny, res, tolerance_m)\n",
        "",
        "walls beside which far beams passed speak against the right place in a saved map",
    ),
    Mutant(
        "alignment/kernels/agreement.py",
        "speck or (mx == 0.0 and my == 0.0) or (k",
        "speck or (k",
        "a wall on a speck of the other map speaks against",
    ),
    Mutant(
        "alignment/kernels/agreement.py",
        "if speck or (mx",
        "if (mx",
        "a speck on a wall of the other map speaks against",
    ),
    Mutant(
        "alignment/kernels/agreement.py",
        "if not (0 <= r < state.shape[0] and 0 <= c < state.shape[1]) or state[r, c] == UNKNOWN:",
        "if (0 <= r < state.shape[0] and 0 <= c < state.shape[1]) and state[r, c] == UNKNOWN:",
        "walls at the rim of a map contradict maps that show more",
    ),
    Mutant(
        "alignment/kernels/agreement.py",
        "px, py = xs + (c + 0.5) * res, ys + (r + 0.5) * res",
        "px, py = xs + c * res, ys + r * res",
        "cells are compared half a cell beside their place",
    ),
    Mutant(
        "alignment/kernels/bending.py",
        " and facing >= FACES_LIKE",
        "",
        "bent maps are drawn to walls that face otherwise",
    ),
    Mutant(
        "alignment/kernels/bending.py",
        "if dx * dx + dy * dy <= reach_m * reach_m and facing",
        "if facing",
        "bent maps are drawn to walls too far away",
    ),
    Mutant(
        "alignment/kernels/bending.py",
        "        for _ in range(rounds):\n"
        "            here[:] = straight - shifts_at(here, nodes, nx0, ny0, spacing_m)\n",
        "        here[:] = straight - shifts_at(here, nodes, nx0, ny0, spacing_m)\n",
        "floor of bent maps is drawn beside its walls",
    ),
    Mutant(
        "alignment/kernels/bending.py",
        "                out[tr, tc] = OCCUPIED\n",
        "                pass\n",
        "thin walls vanish where a map is bent",
    ),
    Mutant(
        "alignment/kernels/surf.py",
        "v < least or n == out.shape[0] or not",
        "v < least or not",
        "SURF writes beyond its memory on maps with very many corners",
    ),
    Mutant(
        "alignment/kernels/surf.py",
        "below[r + dr, c + dc] >= v",
        "below[r + dr, c + dc] > v",
        "one corner is several key points of SURF, of finer scales",
    ),
    Mutant(
        "alignment/kernels/surf.py",
        "above[r + dr, c + dc] >= v",
        "above[r + dr, c + dc] > v",
        "one corner is several key points of SURF, of coarser scales",
    ),
    Mutant(
        "alignment/kernels/surf.py",
        "    if det == 0.0:\n        return False\n",
        "",
        "SURF fails on a map with a flat spot",
    ),
    Mutant(
        "alignment/kernels/surf.py",
        "<= 1.0\n",
        "<= 0.5\n",
        "SURF loses key points between two pixels",
    ),
    Mutant(
        "alignment/kernels/surf.py",
        "<= 1.0\n",
        "<= 2.0\n",
        "SURF has key points where there is no corner",
    ),
)
