"""From robots' maps and alignments to one team map: warping, fusing, the team graph, the fusion tree, pictures."""

import spatial  # noqa: F401 - first: it points numba's cache at the right folder
from merge.config import MergeConfig
from merge.draw import draw_team
from merge.edges import Edge, Pair
from merge.fuse import fuse
from merge.graph import Placement, TeamGraph
from merge.merge_maps import MergeResult, merge_maps
from merge.team import TeamMap, TeamMapper
from merge.warm_up import warm_up
from merge.warp import warp

__all__ = [
    "Edge",
    "MergeConfig",
    "MergeResult",
    "Pair",
    "Placement",
    "TeamGraph",
    "TeamMap",
    "TeamMapper",
    "draw_team",
    "fuse",
    "merge_maps",
    "warm_up",
    "warp",
]
