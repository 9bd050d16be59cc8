"""ROS1 bags without their index: what a robot leaves whose power goes off while it records.

The index stands at the end of a bag; the messages stand before it in chunks, each with the definitions it needs.
"""

from __future__ import annotations

import os
from bz2 import BZ2Decompressor
from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress
from io import BytesIO
from typing import BinaryIO

from lz4.frame import LZ4FrameDecompressor
from rosbags.interfaces import Connection
from rosbags.rosbag1.reader import Chunk, Header, IndexData, Reader, ReaderError, RecordType, read_uint32

MAGIC = b"#ROSBAG V2.0\n"
BROKEN = (ReaderError, ValueError, OSError, EOFError, RuntimeError)
"""What reading raises where the file is cut off or damaged."""
UNPACK: dict[str, Callable[[bytes], bytes]] = {
    "none": lambda packed: packed,
    "bz2": lambda packed: BZ2Decompressor().decompress(packed),
    "lz4": lambda packed: bytes(LZ4FrameDecompressor().decompress(packed)),
}
"""By compression: returns as much as there is, where the end is missing."""


class CutBagReader(Reader):
    """Reads a bag from its beginning to the place where it is cut off, and makes the index anew."""

    def open(self) -> None:
        """Find all messages that are whole; raises ``ReaderError`` where the file is no bag."""
        self.bio = self.path.open("rb")
        try:
            if self.bio.read(len(MAGIC)) != MAGIC:
                raise ReaderError("File magic is invalid.")
            self._found: dict[int, list[IndexData]] = defaultdict(list)
            self._known: dict[int, Connection] = {}
            with suppress(*BROKEN):  # here it is cut off
                while self._read_record(self.bio):
                    pass
            self.indexes = {number: sorted(self._found[number]) for number in self._known}
            self.connections = [c._replace(msgcount=len(self.indexes[c.id])) for c in self._known.values()]
        except BaseException:
            self.close()
            raise

    def _read_record(self, file: BinaryIO) -> bool:
        """Take in the next record where it is a chunk; return whether more may follow."""
        begin = file.tell()
        header = Header.read(file)
        size = read_uint32(file)
        data_begin = file.tell()
        if header.get_uint8("op") == RecordType.CHUNK:
            unpack = UNPACK[header.get_string("compression")]
            packed = file.read(size)
            self.chunks[begin] = Chunk(len(packed), data_begin, unpack)
            self._index(begin, unpack(packed))
        return file.seek(data_begin + size) <= os.fstat(file.fileno()).st_size

    def _index(self, chunk_begin: int, content: bytes) -> None:
        """Note where a chunk's whole messages are, and what it says of their topics."""
        chunk, file = BytesIO(content), self.bio
        with suppress(*BROKEN):  # the chunk in which the bag is cut off
            while chunk.tell() < len(content):
                begin = chunk.tell()
                header = Header.read(chunk)
                number, end = header.get_uint32("conn"), read_uint32(chunk) + chunk.tell()
                if end > len(content):
                    break
                if header.get_uint8("op") == RecordType.MSGDATA:
                    self._found[number].append(IndexData(header.get_time("time"), chunk_begin, begin))
                elif number not in self._known:
                    chunk.seek(begin)
                    self.bio = chunk
                    try:
                        self._known[number] = self.read_connection()
                    finally:
                        self.bio = file
                chunk.seek(end)
