"""A graph of ROS 2 from independent projects: a router of Zenoh, zenoh-ros2-sdk's nodes and rosbags'
types."""

from __future__ import annotations

import queue
import socket
import sys
from collections.abc import Callable
from typing import Any

import pytest
import zenoh
from daemon import REPOSITORY

sys.path.insert(0, str(REPOSITORY / "tests" / "reference"))
make_ros2 = pytest.importorskip("make_ros2")
sdk = pytest.importorskip("zenoh_ros2_sdk")
attachments = pytest.importorskip("zenoh_ros2_sdk.attachment")

SECONDS = 20.0


class Graph:
    """A router, and the SDK's session with all types of the reference in its store."""

    def __init__(self) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        config = zenoh.Config()
        config.insert_json5("mode", '"router"')
        config.insert_json5("listen/endpoints", f'["tcp/127.0.0.1:{self.port}"]')
        config.insert_json5("scouting/multicast/enabled", "false")
        # The same setting as in rmw_zenohd.
        config.insert_json5("routing/router/peers_failover_brokering", "false")
        self.router = zenoh.open(config)
        self.store, services = make_ros2.make_store()
        self.session = sdk.ZenohSession.get_instance("127.0.0.1", self.port)
        self.session.store = self.store
        self.session._registered_types.update({name: name for name in self.store.fielddefs})
        self.hashes = {name: self.store.hash_rihs01(name) for name in services}

    def _settings(self, kind: str) -> dict[str, Any]:
        hash = self.store.hash_rihs01(kind)
        return {"type_hash": hash, "domain_id": 0, "router_port": self.port}

    def messages(self, topic: str, kind: str, **settings: Any) -> Messages:
        received: queue.Queue[Any] = queue.Queue()
        subscriber = sdk.ROS2Subscriber(
            topic, kind, received.put, msg_definition="", **settings, **self._settings(kind)
        )
        return Messages(received, subscriber)

    def publisher(self, topic: str, kind: str) -> Any:
        return sdk.ROS2Publisher(topic, kind, msg_definition="", **self._settings(kind))

    def call(self, path: str, service: str, /, **request: Any) -> Any:
        """Types of `simulation_interfaces`."""
        kind = f"simulation_interfaces/srv/{service}"
        client = sdk.ROS2ServiceClient(
            path, kind, "", "", domain_id=0, router_port=self.port, type_hash=self.hashes[kind], timeout=SECONDS
        )
        try:
            response = client.call(**request)
            assert response is not None, f"{service} has no answer"
            return response
        finally:
            client.close()

    def ask(self, name: str, service: str, request: Any) -> Any:
        """Services of an action, which the SDK does not know."""
        package, folder, short = service.split("/")
        key = f"0/{name}/{package}::{folder}::dds_::{short}_/{self.hashes[service]}"
        attachment = attachments.Attachment(sequence_id=7, timestamp_ns=1, gid=bytes(range(16)))
        replies = self.session.session.get(
            key,
            payload=bytes(self.store.serialize_cdr(request, f"{service}_Request")),
            attachment=attachment.to_bytes(),
            target=zenoh.QueryTarget.ALL_COMPLETE,
            timeout=SECONDS,
        )
        (reply,) = list(replies)
        answered = attachments.Attachment.from_bytes(reply.ok.attachment.to_bytes())
        assert (answered.sequence_id, bytes(answered.gid)) == (7, bytes(range(16)))
        return self.store.deserialize_cdr(reply.ok.payload.to_bytes(), f"{service}_Response")

    def make(self, kind: str, **fields: Any) -> Any:
        """Returns a message with defaults in its other fields."""
        nothing = make_ros2.message(self.store, kind, None, 0)
        for name, value in fields.items():
            setattr(nothing, name, value)
        return nothing

    def tokens(self) -> list[str]:
        return [str(reply.ok.key_expr) for reply in self.session.liveliness.get("@ros2_lv/0/**") if reply.ok]


class Messages:
    """Messages that arrive over a topic."""

    def __init__(self, received: queue.Queue[Any], subscriber: Any) -> None:
        self.received = received
        self.subscriber = subscriber

    def until(self, fits: Callable[[Any], bool]) -> Any:
        while True:
            message = self.received.get(timeout=SECONDS)
            if fits(message):
                return message
