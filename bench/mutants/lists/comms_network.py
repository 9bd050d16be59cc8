"""Mutants of what robots and those who look at them do on a network, and of what a machine's network is said to be."""

from bench.mutants.mutant import Mutant

DOCTOR = "comms/doctor.py"
CONFIG, TRANSPORT, WATCHER = (f"comms/zenoh/{name}.py" for name in ("config", "transport", "watcher"))

MUTANTS = (
    Mutant(
        "comms/zenoh/sensors.py",
        "                self.dropped[kind] += 1\n",
        "                self.dropped[str(error)] += 1\n",
        "a driver that sends a NaN with every reading fills the robot's memory and its log",
    ),
    Mutant(
        TRANSPORT,
        "                del self._tokens[peer]\n",
        "",
        "every robot that was ever here stays in the memory of all",
    ),
    Mutant(
        TRANSPORT,
        "        elif session in (tokens := self._tokens.get(peer, set())):\n            tokens.remove(session)",
        "        else:\n            tokens = self._tokens.setdefault(peer, set())\n            tokens.discard(session)",
        "a robot whose session was never seen is said to leave",
    ),
    Mutant(
        "comms/status/team_view.py",
        "        if gone is None:\n            return False\n",
        "        if True:\n            return False\n",
        "after five hundred robots that came and left mrslam top shows no new one",
    ),
    Mutant(
        "comms/status/team_view.py",
        '                self.dropped["too many robots"] += 1\n',
        "                pass\n",
        "robots that mrslam top leaves out are counted nowhere",
    ),
    Mutant(
        "comms/status/team_view.py",
        "robot = self._robots.pop(key, _Robot())",
        "robot = self._robots.get(key, _Robot())",
        "mrslam top forgets the robot that left last",
    ),
    Mutant(
        "comms/transport/inbox.py",
        "                if len(self._beacons) == self._beacons.maxlen:\n",
        "                if False:\n",
        "beacons that a busy robot lost are counted nowhere",
    ),
    Mutant(
        DOCTOR,
        'socket.SOCK_DGRAM if protocol in ("udp", "quic") else',
        "socket.SOCK_STREAM if False else",
        "mrslam doctor says that a port of datagrams is free where another program has it",
    ),
    Mutant(
        DOCTOR,
        'socket.AF_INET6 if ":" in host else',
        "socket.AF_INET if False else",
        "mrslam doctor says that no address of IPv6 can be listened on",
    ),
    Mutant(
        DOCTOR,
        'host.strip("[]"), int',
        "host, int",
        "mrslam doctor looks for a host with brackets in its name",
    ),
    Mutant(
        DOCTOR,
        'endpoint.partition("#")[0]',
        "endpoint",
        "mrslam doctor refuses endpoints with options that a robot takes",
    ),
    Mutant(
        DOCTOR,
        '    if protocol in ("udp", "quic"):\n        return',
        "    if False:\n        return",
        "mrslam doctor says that robots are down which are reached by datagrams",
    ),
    Mutant(
        DOCTOR,
        'socket.if_nameindex() if name != "lo"]',
        "socket.if_nameindex()]",
        "mrslam doctor finds nothing wrong with a machine without a network",
    ),
    Mutant(
        DOCTOR,
        'if line == "NTPSynchronized=yes"',
        'if line.startswith("NTPSynchronized")',
        "mrslam doctor finds nothing wrong with a clock that nothing keeps right",
    ),
    Mutant(DOCTOR, "8e-6 * PROBES", "1e-6 * PROBES", "mrslam doctor tells megabytes a second as megabits"),
    Mutant(
        DOCTOR, "    if with_multicast:\n", "    if True:\n", "mrslam doctor complains of multicast that nobody uses"
    ),
    Mutant(
        DOCTOR,
        ", *(reachable(endpoint) for endpoint in connect)]",
        "]",
        "mrslam doctor does not look whether anybody answers",
    ),
    Mutant(
        CONFIG,
        '(e.startswith("quic/") and "rel=0" in e)]',
        'e.startswith("quic/")]',
        "over QUIC robots see each other and never exchange a map",
    ),
    Mutant(
        CONFIG,
        '        "scouting/multicast/listen": False,\n',
        "",
        "robots connect to whoever watches them",
    ),
    Mutant(
        CONFIG,
        '        "listen/endpoints": [_tuned(endpoint) for endpoint in listen],\n        "scouting',
        '        "scouting',
        "who watches a team opens a port to all of the network",
    ),
    Mutant(
        "comms/zenoh/session.py",
        """        except zenoh.ZError as error:
            log.warning("a network session""",
        """        except KeyError as error:
            log.warning("a network session""",
        "a robot that ends on a busy machine leaves neither its state nor its maps",
    ),
    Mutant(
        "comms/zenoh/session.py",
        '            log.warning("a network session was not closed in good order: %s", error)\n',
        '            log.warning("a network session was not closed in good order: %s", error)\n            break\n',
        "a session of which one subscriber cannot be undeclared stays open",
    ),
    Mutant(
        "comms/zenoh/session.py",
        "(multicast or not stays_here(endpoints))",
        "not stays_here(endpoints)",
        "nobody is warned of an open team that is found by multicast",
    ),
    Mutant(
        "comms/zenoh/session.py",
        "if keys is None and (multicast",
        "if (multicast",
        "a team with keys is told that strangers read its maps",
    ),
    Mutant(
        TRANSPORT,
        "len(info.peers_zid()) + len(info.routers_zid())",
        "len(info.peers_zid())",
        "a robot that a router serves says that it has no link",
    ),
    Mutant(
        TRANSPORT,
        "        withdraw(self._announced)\n",
        "",
        "a program that closes a robot still tells where it listens",
    ),
    Mutant(
        TRANSPORT,
        "announce(team, robot_id, listen)",
        "announce(team, robot_id, listen_datagrams)",
        "mrslam top does not find the robots of its own machine",
    ),
    Mutant(
        WATCHER,
        "parts[1], parts[2], sample.payload",
        "parts[1], parts[1], sample.payload",
        "what any robot says of itself is shown as said by one that is called as the team",
    ),
    Mutant(
        WATCHER,
        "None, sample.kind == zenoh.SampleKind.PUT",
        "None, True",
        "robots that left are shown as there",
    ),
    Mutant(
        "comms/doctor.py",
        'SOCK_DGRAM if protocol in ("udp", "quic") else',
        'SOCK_DGRAM if protocol == "udp" else',
        "a port that another program uses for QUIC is called free",
    ),
    Mutant(
        "comms/doctor.py",
        '    if protocol in ("udp", "quic"):\n        return',
        '    if protocol == "udp":\n        return',
        "a robot that is reached over QUIC is called silent",
    ),
)
