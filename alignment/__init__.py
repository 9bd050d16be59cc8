"""Two maps in, how they fit together out: proposals, refinement, verification."""

from mrslam.alignment.align import EXHAUSTIVE, align
from mrslam.alignment.aligners import ALIGNERS, Aligner
from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.evidence import Evidence, WallEvidence
from mrslam.alignment.repetition import look_alikes, open_share
from mrslam.alignment.result import Alignment, Candidate, Prior, Rejection
from mrslam.alignment.stability import StabilityCheck
from mrslam.alignment.verification.acceptance import acceptance_index
from mrslam.alignment.warm_up import warm_up

__all__ = [
    "ALIGNERS",
    "EXHAUSTIVE",
    "Aligner",
    "Alignment",
    "AlignmentConfig",
    "Candidate",
    "Evidence",
    "Prior",
    "Rejection",
    "StabilityCheck",
    "WallEvidence",
    "acceptance_index",
    "align",
    "look_alikes",
    "open_share",
    "warm_up",
]
