"""Who may write under which name in a closed team, as rules that Zenoh enforces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

ROBOT, ROUTER = "robot", "router"
"""What a member of the team's roster is."""


def access_rules(team: str, roster: Mapping[str, str]) -> dict[str, Any]:
    """Return Zenoh access rules; ``roster``: name -> role. A robot writes only under its own name, a router for all."""
    everything = f"mrslam/{team}/**"
    listening = ["declare_subscriber", "liveliness_query", "declare_liveliness_subscriber"]
    writing = ["put", "delete", "liveliness_token", "reply"]
    rules = [
        _rule("listen", [everything], listening, ["ingress", "egress"]),
        _rule("send", [everything], writing, ["egress"]),
        _rule("pass-on", [everything], writing, ["ingress"]),
    ]
    policies = []
    for name, role in sorted(roster.items()):
        mine = "pass-on"
        if role != ROUTER:
            mine = f"write-{name}"
            rules.append(_rule(mine, [f"mrslam/{team}/{name}/**"], writing, ["ingress"]))
        policies.append({"id": f"policy-{name}", "rules": ["listen", "send", mine], "subjects": [f"cn-{name}"]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": f"cn-{name}", "cert_common_names": [name]} for name in sorted(roster)],
        "policies": policies,
    }


def _rule(name: str, keys: list[str], messages: list[str], flows: list[str]) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "flows": flows, "messages": messages, "key_exprs": keys}
