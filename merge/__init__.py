"""From robots' maps and alignments to one team map: warping, fusing, the team graph, the fusion tree, pictures."""

from mrslam.merge.batch.merge_maps import MergeResult, merge_maps
from mrslam.merge.config import MergeConfig
from mrslam.merge.graph.edges import Edge, Pair
from mrslam.merge.grids.fuse import fuse
from mrslam.merge.grids.warp import warp
from mrslam.merge.joint.bend import Bend
from mrslam.merge.joint.bent_team import BentTeam
from mrslam.merge.joint.join import JointMap, join
from mrslam.merge.joint.local_match import LocalMatcher
from mrslam.merge.joint.trail import Trail
from mrslam.merge.team import TeamMap, TeamMapper
from mrslam.merge.team_graph import Placement, TeamGraph
from mrslam.merge.warm_up import warm_up

__all__ = [
    "Bend",
    "BentTeam",
    "Edge",
    "JointMap",
    "LocalMatcher",
    "MergeConfig",
    "MergeResult",
    "Pair",
    "Placement",
    "TeamGraph",
    "TeamMap",
    "TeamMapper",
    "Trail",
    "fuse",
    "join",
    "merge_maps",
    "warm_up",
    "warp",
]
