"""Carry robots' messages your own way, here through queues in memory: python examples/own_transport.py [TICKS]."""

import sys
from queue import Empty, SimpleQueue
from typing import ClassVar

from mrslam.comms import CommsNode, ExchangeDone, Incoming, Send
from mrslam.sim_driver.worlds import load_world
from mrslam.spatial import LocalMap, TiledMap


class QueueTransport:
    """One robot's end (comms.Transport). All that a transport must do is to try: what is lost is asked for again."""

    ends: ClassVar[dict[str, "QueueTransport"]] = {}

    def __init__(self, name):
        self.name, self.inbox = name, SimpleQueue()
        self.ends[name] = self

    def send(self, effect):
        """Hand the bytes to one robot, or to all where ``effect.to`` is None; never wait."""
        for name, end in self.ends.items():
            if name != self.name and effect.to in (None, name):
                end.inbox.put(Incoming(effect.payload, self.name, effect.lane))

    def poll(self, timeout_s):
        """Return what arrived; wait at most so long for the first."""
        arrived = []
        try:
            while True:
                arrived.append(self.inbox.get(timeout=0.0 if arrived else timeout_s))
        except Empty:
            return arrived

    def close(self):
        """Leave; twice does no harm."""
        self.ends.pop(self.name, None)


nodes = {name: CommsNode(name, team="depot", boot_id=1) for name in ("r1", "r2")}
transports = {name: QueueTransport(name) for name in nodes}
nodes["r1"].publish(LocalMap(TiledMap.from_grid(load_world("arena1").grid)), now_ns=0)
for tick in range(int((*sys.argv, "400")[1])):
    now_ns = tick * 100_000_000
    for name, node in nodes.items():
        effects = node.on_tick(now_ns)
        for arrival in transports[name].poll(0.0):
            effects += node.on_message(arrival.payload, now_ns, arrival.sender)
        for effect in effects:
            if isinstance(effect, Send):
                transports[name].send(effect)
            elif isinstance(effect, ExchangeDone):
                print(f"{now_ns / 1e9:.1f} s: {name} has exchanged maps with {effect.peer}")
area_m2 = nodes["r2"].store.maps["r1"].map.to_grid().known_area_m2()
print(f"r2 holds r1's map of {area_m2:.0f} m2")
