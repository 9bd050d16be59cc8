"""Two maps in, how they fit together out: proposals, refinement, verification."""

import spatial  # noqa: F401 - points numba's cache at the right folder first
from alignment.acceptance import acceptance_index
from alignment.align import align
from alignment.aligners import ALIGNERS, Aligner
from alignment.config import AlignmentConfig
from alignment.result import Alignment, Candidate, Prior, Rejection
from alignment.stability import StabilityCheck
from alignment.warm_up import warm_up

__all__ = [
    "ALIGNERS",
    "Aligner",
    "Alignment",
    "AlignmentConfig",
    "Candidate",
    "Prior",
    "Rejection",
    "StabilityCheck",
    "acceptance_index",
    "align",
    "warm_up",
]
