"""Bytes on the wire: frames, messages, and the codecs of tiles and keyframes. See docs/protocol.md."""
