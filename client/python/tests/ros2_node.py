"""A node under test: it moves the arm's joints as soon as it sees them. A process with zenoh-ros2-sdk, which finds its
graph by the variables of the nodes of `rmw_zenoh`."""

from __future__ import annotations

import os
import queue
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import zenoh_ros2_sdk  # pyright: ignore[reportMissingTypeStubs]

sys.path.insert(0, str(Path(__file__).parents[3] / "tests" / "reference"))
import make_ros2  # pyright: ignore[reportMissingImports]

sdk: Any = zenoh_ros2_sdk
reference: Any = make_ros2
GOAL = 0.4


def main() -> None:
    """Publishes positions for ever."""
    found = re.fullmatch(r'connect/endpoints=\["tcp/127\.0\.0\.1:(\d+)"\]', os.environ["ZENOH_CONFIG_OVERRIDE"])
    assert found is not None and os.environ["RMW_IMPLEMENTATION"] == "rmw_zenoh_cpp"
    port, domain = int(found[1]), int(os.environ["ROS_DOMAIN_ID"])
    store: Any = reference.make_store()[0]
    session = sdk.ZenohSession.get_instance("127.0.0.1", port)
    session.store = store
    session._registered_types.update({name: name for name in store.fielddefs})

    def settings(kind: str) -> dict[str, Any]:
        return {"msg_definition": "", "type_hash": store.hash_rihs01(kind), "domain_id": domain, "router_port": port}

    states: queue.Queue[Any] = queue.Queue()
    state, command = "sensor_msgs/msg/JointState", "std_msgs/msg/Float64MultiArray"
    subscriber = sdk.ROS2Subscriber("/joint_states", state, states.put, **settings(state))
    publisher = sdk.ROS2Publisher("/forward_position_controller/commands", command, **settings(command))
    layout = reference.message(store, "std_msgs/msg/MultiArrayLayout", None, 0)
    while subscriber is not None:
        seen = states.get()
        publisher.publish(layout=layout, data=np.full(len(seen.name), GOAL))


if __name__ == "__main__":
    main()
