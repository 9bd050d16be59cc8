"""A teammate of one node that says what a test lets it say, and nothing else."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from mrslam.comms import CommsNode, Send
from mrslam.comms.maps.chunks import make_chunks
from mrslam.comms.maps.manifests import make_manifest
from mrslam.comms.maps.store import NOTHING, MapStore
from mrslam.comms.wire.bitmask import from_mask
from mrslam.comms.wire.messages import AnyMessage, Beacon, Get, Open, decode, encode

BOOT = 5000


class Puppet:
    """One teammate; ``xid``: of the exchange that it opened last."""

    def __init__(self, node: CommsNode, name: str) -> None:
        self.node, self.name, self.xid = node, name, 0

    def say(self, message: AnyMessage) -> list[Any]:
        """Say it, and return what the node does: messages that it sends, and other effects as they are."""
        done = self.node.on_message(encode(message, self.node.team_tag), 0, self.name)
        return [decode(one.payload, self.node.team_tag, 1 << 24) if isinstance(one, Send) else one for one in done]

    def meet(self, *digest: tuple[str, int, int], saved: Iterable[tuple[str, int, int]] | None = None) -> list[Any]:
        """Come into sight, and open an exchange as one that holds these versions of robots' maps and of saved ones."""
        self.xid += 1
        self.say(Beacon(self.name, BOOT, self.xid, 0, 500, 0, [], 0, None))
        self.node.set_link_quality(self.name, 1.0, 0)
        return self.say(Open(self.name, BOOT, self.xid, list(digest), [], None if saved is None else list(saved)))

    def bring(self, store: MapStore, robot: str, most: int = 1 << 30) -> list[Any]:
        """Offer a map whole, and send the chunks that are asked for, at most so many; return all that the node does."""
        manifest = make_manifest(store, self.name, self.xid, robot, NOTHING, None)
        assert manifest is not None
        done = self.say(manifest)
        for one in done:
            if isinstance(one, Get):
                items = from_mask(one.mask, len(manifest.rows) + len(manifest.blocks))
                for chunk in list(make_chunks(store, manifest, items, self.node.config))[:most]:
                    most -= 1
                    done += self.say(chunk)
        return done
