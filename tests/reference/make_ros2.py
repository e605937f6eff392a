#!/usr/bin/env python3
"""Makes ros2.json: rosbags' bytes, hashes and texts for each type of ROS 2 that simd uses.

Each message is made twice: with numbers and texts in all fields, by a rule, and with empty fields.
`ros2_definitions.py` has the types that rosbags lacks. Services and actions are composed here according to
REP-2016.
"""

import json
import re
from importlib.metadata import version
from itertools import count
from pathlib import Path

import numpy as np
import xxhash
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from ros2_definitions import DEFINITIONS

HERE = Path(__file__).resolve().parent
FOLLOW = "control_msgs/action/FollowJointTrajectory"
NOTHING = "structure_needs_at_least_one_member"
TIME = "builtin_interfaces/msg/Time"

MESSAGES = """
action_msgs/msg/GoalInfo action_msgs/msg/GoalStatus action_msgs/msg/GoalStatusArray
builtin_interfaces/msg/Duration builtin_interfaces/msg/Time
geometry_msgs/msg/Accel geometry_msgs/msg/Point geometry_msgs/msg/Pose geometry_msgs/msg/PoseStamped
geometry_msgs/msg/Quaternion geometry_msgs/msg/Transform geometry_msgs/msg/TransformStamped geometry_msgs/msg/Twist
geometry_msgs/msg/Vector3 geometry_msgs/msg/Wrench geometry_msgs/msg/WrenchStamped
rcl_interfaces/msg/Log rosgraph_msgs/msg/Clock service_msgs/msg/ServiceEventInfo
sensor_msgs/msg/CameraInfo sensor_msgs/msg/Image sensor_msgs/msg/Imu sensor_msgs/msg/JointState
sensor_msgs/msg/LaserScan sensor_msgs/msg/PointCloud2 sensor_msgs/msg/PointField sensor_msgs/msg/Range
sensor_msgs/msg/RegionOfInterest
std_msgs/msg/Float64MultiArray std_msgs/msg/Header std_msgs/msg/MultiArrayDimension std_msgs/msg/MultiArrayLayout
std_msgs/msg/String tf2_msgs/msg/TFMessage
trajectory_msgs/msg/JointTrajectory trajectory_msgs/msg/JointTrajectoryPoint
trajectory_msgs/msg/MultiDOFJointTrajectory trajectory_msgs/msg/MultiDOFJointTrajectoryPoint
unique_identifier_msgs/msg/UUID
""".split()


def named(name, kind):
    return (name, (Nodetype.NAME, kind))


def base(name, kind):
    return (name, (Nodetype.BASE, (kind, 0)))


def make_store():
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in DEFINITIONS.items():
        # A type without a package belongs to the same one, also in services and actions.
        text = re.sub(r"^([A-Z]\w+)", rf"{name.split('/')[0]}/msg/\1", text, flags=re.MULTILINE)
        # rosbags calls everything that it reads a message.
        (fields,) = get_types_from_msg(text, name).values()
        store.register({name: fields})
    uuid = named("goal_id", "unique_identifier_msgs/msg/UUID")
    info = "action_msgs/msg/GoalInfo"
    codes = ["NONE", "REJECTED", "UNKNOWN_GOAL_ID", "GOAL_TERMINATED"]
    store.register(
        {
            f"{FOLLOW}_SendGoal_Request": ([], [uuid, named("goal", f"{FOLLOW}_Goal")]),
            f"{FOLLOW}_SendGoal_Response": ([], [base("accepted", "bool"), named("stamp", TIME)]),
            f"{FOLLOW}_GetResult_Request": ([], [uuid]),
            f"{FOLLOW}_GetResult_Response": ([], [base("status", "int8"), named("result", f"{FOLLOW}_Result")]),
            f"{FOLLOW}_FeedbackMessage": ([], [uuid, named("feedback", f"{FOLLOW}_Feedback")]),
            "action_msgs/srv/CancelGoal_Request": ([], [named("goal_info", info)]),
            "action_msgs/srv/CancelGoal_Response": (
                [(f"ERROR_{code}", "int8", number) for number, code in enumerate(codes)],
                [base("return_code", "int8"), ("goals_canceling", (Nodetype.SEQUENCE, ((Nodetype.NAME, info), 0)))],
            ),
        }
    )
    services = sorted(
        name.removesuffix("_Request")
        for name in store.fielddefs
        if name.endswith("_Request") and name.startswith((FOLLOW, "action_msgs", "simulation_interfaces"))
    )
    for service in services:
        pair = [f"{service}_Request", f"{service}_Response"]
        store.register(
            {
                f"{service}_Event": (
                    [],
                    [
                        named("info", "service_msgs/msg/ServiceEventInfo"),
                        ("request", (Nodetype.SEQUENCE, ((Nodetype.NAME, pair[0]), 1))),
                        ("response", (Nodetype.SEQUENCE, ((Nodetype.NAME, pair[1]), 1))),
                    ],
                ),
                service: (
                    [],
                    [
                        named("request_message", pair[0]),
                        named("response_message", pair[1]),
                        named("event_message", f"{service}_Event"),
                    ],
                ),
            }
        )
    return store, services


def number(kind, numbers):
    if kind == "bool":
        return next(numbers) % 2 == 1
    if kind == "string":
        return f"text {next(numbers)} \u00e4"
    if kind.startswith("float"):
        return next(numbers) * 1.25 - 7
    return next(numbers) % 100


def value(store, field, desc, numbers, length):
    """Returns the value of a field: sequences have `length` elements, and none have 0 numbers."""
    node, rest = desc
    if field == NOTHING:
        return 0
    if node == Nodetype.NAME:
        return message(store, rest, numbers, length)
    if node == Nodetype.BASE:
        return number(rest[0], numbers) if numbers else {"string": "", "bool": False}.get(rest[0], 0)
    element, size = rest
    size = size if node == Nodetype.ARRAY else length
    values = [value(store, field, element, numbers, length) for _ in range(size)]
    if element[0] == Nodetype.BASE and element[1][0] not in ("string", "bool"):
        return np.array(values, dtype={"char": "uint8"}.get(element[1][0], element[1][0]))
    return values


def message(store, name, numbers, length):
    fields = store.fielddefs[name][1]
    return store.types[name](**{field: value(store, field, desc, numbers, length) for field, desc in fields})


def gid(token):
    """XXH3-128, the low half first, in the layout of `rmw_zenoh`."""
    return xxhash.xxh3_128(token.encode()).digest()[::-1].hex()


def main():
    store, services = make_store()
    names = MESSAGES + list(DEFINITIONS)
    names += [name for name in store.fielddefs if name not in names and name.startswith((FOLLOW, "action_msgs/srv"))]
    names = [name for name in names if name not in services and not name.endswith("_Event")]
    types = []
    for name in sorted(names):
        filled = store.serialize_cdr(message(store, name, count(1), 3), name)
        odd = store.serialize_cdr(message(store, name, count(50), 1), name)
        empty = store.serialize_cdr(message(store, name, None, 0), name)
        types.append(
            {
                "name": name,
                "hash": store.hash_rihs01(name),
                # Text is for recorded types: messages, not parts of services and actions.
                "definition": store.generate_msgdef(name, ros_version=2)[0] if "/msg/" in name else None,
                "payloads": [bytes(payload).hex() for payload in (filled, odd, empty)],
            }
        )
    made = {
        "made_by": f"make_ros2.py with rosbags {version('rosbags')} and xxhash {version('xxhash')}",
        "messages": types,
        # Texts as long as tokens: the hash uses a different method for each range of lengths.
        "gids": {text: gid(text) for text in ("a" * n for n in (1, 5, 12, 60, 130, 200, 239, 240, 241, 300, 700))},
        "services": {service: store.hash_rihs01(service) for service in services},
    }
    (HERE / "ros2.json").write_text(json.dumps(made, indent=1) + "\n")


if __name__ == "__main__":
    main()
