"""The aligners by name: each gives candidates, all are judged by one verification."""

from __future__ import annotations

from collections.abc import Callable

from alignment.config import AlignmentConfig
from alignment.features import orb
from alignment.prepared import PreparedMap
from alignment.result import Candidate, Prior
from alignment.search import exhaustive

Aligner = Callable[[PreparedMap, PreparedMap, AlignmentConfig, Prior | None], list[Candidate]]
"""``(a, b, config, prior) -> candidates``, best first; deterministic."""

ALIGNERS: dict[str, Aligner] = {"orb": orb, "auto": exhaustive}
"""What ``align(method=...)`` knows."""
