"""All messages, and their encoding and decoding. docs/protocol.md describes each byte."""

from __future__ import annotations

import msgspec

from mrslam.comms.wire.exchange_messages import (
    ALREADY_OVER,
    GIVE_NO_MORE,
    HOLD_ALL,
    Accept,
    Ask,
    Chunk,
    Done,
    Get,
    Manifest,
    Open,
    Refuse,
    SignedManifest,
)
from mrslam.comms.wire.fields import Message, Version
from mrslam.comms.wire.frames import WireError, frame, unframe
from mrslam.comms.wire.presence_messages import Beacon, Bye, LinkRow, Status

__all__ = [
    "ALREADY_OVER",
    "GIVE_NO_MORE",
    "HOLD_ALL",
    "Accept",
    "AnyMessage",
    "Ask",
    "Beacon",
    "Bye",
    "Chunk",
    "Done",
    "Get",
    "LinkRow",
    "Manifest",
    "Message",
    "Open",
    "Refuse",
    "SignedManifest",
    "Status",
    "Version",
    "decode",
    "encode",
]

AnyMessage = Beacon | Open | Accept | Refuse | Ask | Manifest | Get | Chunk | Done | Bye | SignedManifest | Status

_encoder = msgspec.msgpack.Encoder()
_decoder = msgspec.msgpack.Decoder(AnyMessage)


def encode(message: Message, tag: int) -> bytes:
    """Return the message framed for the team with this tag."""
    return frame(_encoder.encode(message.shortest() if isinstance(message, Beacon) else message), tag)


def decode(payload: bytes, tag: int, max_bytes: int) -> AnyMessage:
    """Return the message, or raise :class:`mrslam.comms.wire.frames.WireError`; nothing else is ever raised."""
    body = unframe(payload, tag, max_bytes)
    try:
        message: AnyMessage = _decoder.decode(body)
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError, RecursionError) as error:
        raise WireError("malformed", str(error)) from error
    return message
