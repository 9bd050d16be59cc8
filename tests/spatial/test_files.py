import contextlib
import errno
import os
from pathlib import Path

import pytest

from mrslam.spatial.files import atomic as files
from tests.full_disk import full_disk


def test_content_is_replaced_and_folders_are_made(tmp_path):
    path = tmp_path / "deep" / "down" / "a.txt"
    files.write_text(path, "first ä")
    files.write_text(path, "second")
    assert path.read_text(encoding="utf-8") == "second"
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("broken", ["fsync", "write", "replace"])
def test_a_failure_leaves_the_old_file_and_no_rubbish(tmp_path, monkeypatch, broken):
    path = tmp_path / "a.bin"
    files.write_bytes(path, b"good")

    if broken == "fsync":
        monkeypatch.setattr(os, "fsync", full_disk)
    elif broken == "replace":
        monkeypatch.setattr(Path, "replace", full_disk)
    else:
        real_open = Path.open

        def open_full(self, *args, **kwargs):
            file = real_open(self, *args, **kwargs)
            return _FullFile(file)

        monkeypatch.setattr(Path, "open", open_full)
    with pytest.raises(OSError, match="No space left"):
        files.write_bytes(path, b"new content")
    monkeypatch.undo()
    assert path.read_bytes() == b"good"
    assert list(tmp_path.iterdir()) == [path]


class _FullFile:
    """A file on a full disk."""

    def __init__(self, file):
        self._file = file

    def __enter__(self):
        return self

    def __exit__(self, *_exc):
        self._file.close()

    def write(self, _content):
        raise OSError(28, "No space left on device")


def test_the_target_is_never_seen_half_written(tmp_path, monkeypatch):
    path = tmp_path / "a.bin"
    files.write_bytes(path, b"old")
    seen = []
    real_fsync = os.fsync

    def watching(descriptor):
        seen.append(path.read_bytes())
        real_fsync(descriptor)

    monkeypatch.setattr(os, "fsync", watching)
    files.write_bytes(path, b"new" * 1000)
    assert seen[0] == b"old"
    assert path.read_bytes() == b"new" * 1000


def test_two_threads_writing_one_file_leave_one_whole_content(tmp_path):
    from concurrent.futures import ThreadPoolExecutor

    path = tmp_path / "a.bin"
    contents = [bytes([i]) * 200_000 for i in range(8)]
    with ThreadPoolExecutor(8) as pool:
        for _ in range(5):
            list(pool.map(lambda content: files.write_bytes(path, content), contents))
            assert path.read_bytes() in contents
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_is_held_by_one_at_a_time(tmp_path):
    folder = tmp_path / "new" / "out"
    with files.held(folder):
        assert folder.is_dir()
        with pytest.raises(files.InputError, match="out: another process writes there"), files.held(folder):
            pass
    with files.held(folder):
        pass


def test_a_file_cannot_be_held(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(files.InputError, match="cannot be made a folder"), files.held(tmp_path / "out"):
        pass


@pytest.mark.parametrize(("number", "works"), [(errno.ENOLCK, True), (errno.EOPNOTSUPP, True), (errno.EIO, False)])
def test_a_drive_without_locks_can_be_written_on(tmp_path, monkeypatch, number, works):
    def flock(*_args):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(files.fcntl, "flock", flock)
    refused = contextlib.nullcontext() if works else pytest.raises(OSError, match=os.strerror(number))
    with refused, files.held(tmp_path):
        files.write_text(tmp_path / "a", "written")
    assert (tmp_path / "a").exists() is works
