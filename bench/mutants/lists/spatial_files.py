"""Mutants of reading and writing files."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "spatial/files/map_files.py",
        'if path.suffix.lower() in (".yaml", ".yml")',
        'if path.suffix in (".yaml", ".yml")',
        "a map whose file ends in .YAML is taken for an image",
    ),
    Mutant(
        "spatial/files/map_files.py",
        'log.warning("%s: %s, which names',
        'log.debug("%s: %s, which names',
        "nobody hears that a map's own resolution and origin were passed over",
    ),
    Mutant(
        "spatial/files/map_files.py",
        "abs(yaw) <= STRAIGHT_RAD",
        "yaw == 0.0",
        "a map whose origin is turned by a rounding error is refused",
    ),
    Mutant(
        "spatial/files/map_files.py",
        "if cells.dtype != np.int8:",
        "if False:",
        "arrays of other numbers are taken for cells, and walls become unknown",
    ),
    Mutant(
        "spatial/files/pixels.py",
        'self.mode == "trinary" and {',
        "{",
        "in maps in proportion a light grey is unknown",
    ),
    Mutant(
        "spatial/files/saved_map.py",
        "info = zipfile.ZipInfo(name)",
        "info = zipfile.ZipInfo(name, __import__('time').localtime()[:6])",
        "a map that is saved twice is two different files",
    ),
    Mutant(
        "spatial/files/saved_map.py",
        "if not self.sessions or len(counts) > 1:",
        "if len(counts) > 1:",
        "a saved map of no session has no version",
    ),
    Mutant(
        "spatial/files/saved_map.py",
        "or number < 1:",
        "or number < 0:",
        "a saved map of no format is read",
    ),
    Mutant(
        "spatial/files/saved_map.py",
        "decoded_image(path / IMAGE",
        "decoded_image(path",
        "of a damaged saved map nobody hears which part is damaged",
    ),
    Mutant(
        "spatial/files/images.py",
        "        log.setLogLevel(level)\n",
        "        pass\n",
        "once a map is read a program's own images fail without a word",
    ),
    Mutant(
        "spatial/files/images.py",
        "(1 if top < 256 else 2)",
        "1",
        "an image of wide greys that is cut short is only said to be damaged",
    ),
    Mutant(
        "spatial/files/keyframes.py",
        "T_map_base.dtype != np.float64 or",
        "",
        "poses of complex numbers are read and fail later",
    ),
    Mutant(
        "spatial/files/state_file.py",
        ".reshape(shape).copy()",
        ".reshape(shape)",
        "a robot that goes on from a checkpoint fails when it first writes into what was restored",
    ),
    Mutant(
        "spatial/files/state_file.py",
        " if dtype in DTYPES:",
        ":",
        "arrays of kinds that no state has are restored",
    ),
    Mutant(
        "spatial/files/atomic.py",
        "if error.errno not in (errno.ENOLCK, errno.EOPNOTSUPP):",
        "if True:",
        "on a network drive without locks nothing can be written",
    ),
    Mutant(
        "spatial/files/archives.py",
        "allow_pickle=False) as archive,",
        "allow_pickle=True) as archive,",
        "a map from a stranger runs what it holds",
    ),
)
