"""Mutants of comms/wire."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "comms/wire/frames.py",
        "    if len(payload) > max_bytes:",
        "    if False:",
        "a message of any size is decoded: a stranger fills the memory",
    ),
    Mutant(
        "comms/wire/frames.py",
        "    if version != PROTOCOL_VERSION:",
        "    if version > PROTOCOL_VERSION:",
        "messages of an older program are read as if they were of this one",
    ),
    Mutant(
        "comms/wire/frames.py",
        "    if magic != MAGIC:",
        "    if False:",
        "messages of another program on the same keys are read",
    ),
    Mutant(
        "comms/wire/bitmask.py",
        "np.zeros(max(items) + 1, dtype=np.uint8)",
        "np.zeros(max(items), dtype=np.uint8)",
        "the last tile of a map cannot be asked for",
    ),
    Mutant(
        "comms/wire/keyframe_codec.py",
        "np.clip(scaled, -POSE_LIMIT, POSE_LIMIT).astype(np.int32)",
        "scaled.astype(np.int32)",
        "a pose 1000 km away makes a map that others refuse",
    ),
    Mutant(
        "comms/wire/keyframe_codec.py",
        "if len(held) <= len(scans) and scans.part(0, len(held)).equals(held) else 0",
        "if len(held) <= len(scans) else 0",
        "after a map was begun again others keep the scans of the old one",
    ),
    Mutant(
        "comms/wire/keyframe_codec.py",
        "block.scans if len(block.scans) else KeyScans.blank(block.stamps_ns.size) for",
        "block.scans for",
        "scans are drawn at the keyframes of another block",
    ),
    Mutant(
        "comms/wire/tile_codec.py",
        "present[255] = True",
        "present[255] = present[255]",
        "tiles without an unknown cell cannot be read",
    ),
    Mutant(
        "comms/wire/tile_codec.py",
        "or palette[-1] > TOP_VALUE ",
        "",
        "cells of more than 100 percent are taken over from others",
    ),
    Mutant(
        "comms/wire/tile_codec.py", "or palette[0] != 0 ", "", "unknown cells become occupied with a damaged palette"
    ),
    Mutant("comms/wire/tile_codec.py", "or not _rises(palette)", "", "a palette with a value twice is taken"),
    Mutant(
        "comms/wire/exchange_messages.py",
        "resolution_m: Annotated[float, msgspec.Meta(ge=1e-3, le=100.0)]",
        "resolution_m: Annotated[float, msgspec.Meta(ge=0.0, le=100.0)]",
        "a map with cells of no size is taken",
    ),
    Mutant(
        "comms/wire/exchange_messages.py",
        "code: Annotated[int, msgspec.Meta(ge=HOLD_ALL, le=ALREADY_OVER)]",
        "code: int",
        "an exchange ends with a code that does not exist",
    ),
    Mutant(
        "comms/wire/exchange_messages.py",
        "raw_bytes: Annotated[int, msgspec.Meta(ge=0, le=1 << 20)]",
        "raw_bytes: Annotated[int, msgspec.Meta(ge=0)]",
        "a chunk may ask for any amount of memory",
    ),
    Mutant(
        "comms/wire/fields.py",
        "TileCoordinate = Annotated[int, msgspec.Meta(ge=-(2**20), le=2**20)]",
        "TileCoordinate = int",
        "a tile 10^18 cells away is taken: the map cannot be drawn",
    ),
    Mutant(
        "comms/wire/frames.py",
        're.compile(r"(?!\\.)[A-Za-z0-9_.-]{1,64}")',
        're.compile(r"[A-Za-z0-9_.-]{1,64}")',
        'a robot called ".." writes its files into the folder above',
    ),
    Mutant(
        "comms/wire/bitmask.py",
        'bitorder="little")[:size]',
        'bitorder="little")',
        "a request with bits beyond the manifest ends the robot",
    ),
    Mutant(
        "comms/wire/keyframe_codec.py",
        "return sizes + poses +",
        "return poses +",
        "keyframes and scans of another map may have the same hash",
    ),
    Mutant(
        "comms/wire/keyframe_codec.py",
        "if not 0 < count <= BLOCK:",
        "if not 0 < count:",
        "a block of more than 64 keyframes is taken: the numbers of all after it are wrong",
    ),
    Mutant(
        "comms/wire/keyframe_codec.py",
        "or known + new not in (0, count) or",
        "or",
        "scans for some keyframes only are taken, and each is drawn at another keyframe",
    ),
    Mutant(
        "comms/wire/keyframe_codec.py",
        "        if not -(2**63) <= value < 2**63:",
        "        if False:",
        "a damaged block ends the robot that receives it",
    ),
    Mutant(
        "comms/wire/presence_messages.py",
        "period_ms: Annotated[int, msgspec.Meta(ge=1, le=10**9)]",
        "period_ms: Annotated[int, msgspec.Meta(le=10**9)]",
        "a beacon with a period of 0 ends all who hear it",
    ),
    Mutant(
        "comms/wire/presence_messages.py",
        '    mode: Annotated[int, msgspec.Meta(ge=0, le=2)]\n    """Index in ``MODES``."""',
        '    mode: int\n    """Index in ``MODES``."""',
        "a beacon with a mode that does not exist ends all who hear it",
    ),
    Mutant(
        "comms/wire/step_coder.py",
        "kind = KEPT if k < kept else NEW",
        "kind = NEW",
        "a corrected map costs twice the bytes",
    ),
    Mutant(
        "comms/wire/keyframe_codec.py",
        "return steps\n",
        "return steps[:0]\n",
        "the first keyframes of every exchange cost twice the bytes",
    ),
    Mutant(
        "comms/wire/keyframe_codec.py",
        "    while unit < UNIT_MOST and",
        "    while False and",
        "stamps cost more than poses",
    ),
    Mutant(
        "comms/wire/keyframe_codec.py",
        "coded, False) != size + READ_AHEAD:",
        "coded, False) < 0:",
        "bytes that belong to nothing pass for keyframes",
    ),
    Mutant(
        "comms/wire/keyframe_codec.py",
        "        steps[:, 0] *= 10**unit\n",
        "",
        "keyframes of others have stamps of the year 1970",
    ),
    Mutant(
        "comms/wire/cell_coder.py",
        "_value_context(old, west, north), bits",
        "_value_context(old, north, west), bits",
        "robots of this version read other cells than robots of the version before sent",
    ),
)
