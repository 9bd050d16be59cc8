"""The command ``mrslam``: one file a sub-command, loaded only when it is called."""

from __future__ import annotations

import gc
import sys

from mrslam.sim_driver.cli.app import app

NEW_OBJECTS = 50_000
"""Garbage is looked for after this number of new objects: imports make many, and none of them is garbage."""


def main() -> None:
    """Run the command; a known error is one line and exit code 1, a wrong call exit code 2, Ctrl-C 130."""
    try:
        _run()
    except KeyboardInterrupt:
        print("mrslam: stopped", file=sys.stderr)
        sys.exit(130)


def _run() -> None:
    from mrslam.spatial.errors import InputError

    gc.set_threshold(NEW_OBJECTS)
    try:
        app()
    except SystemExit as end:
        if _is_broken_off(end):
            raise KeyboardInterrupt from end
        raise
    except InputError as error:
        print(f"mrslam: {error}", file=sys.stderr)
        sys.exit(1)
    except OSError as error:  # a full disk, a folder that may not be written to
        if error.filename is None:
            raise
        print(f"mrslam: {error.filename2 or error.filename}: {error.strerror}", file=sys.stderr)
        sys.exit(1)


def _is_broken_off(end: SystemExit) -> bool:
    """Return whether Ctrl-C ended the command, of which the library that reads its arguments says nothing."""
    reason: BaseException | None = end
    while reason is not None and not isinstance(reason, KeyboardInterrupt):
        reason = reason.__cause__ or reason.__context__
    return reason is not None
