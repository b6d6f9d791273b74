"""Writes bags of ROS 2 with rosbags: one of SQLite, one of MCAP packed by zstd, one with packed messages.

A robot feeds by a screw: its motor turns, in radians. A force sensor, a point and a frame of tf follow by
their own rates. One message in three is big-endian.
"""

import json
import math
import sys
from pathlib import Path

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
import numpy as np

store = get_typestore(Stores.ROS2_HUMBLE)
types = store.types
Time = types["builtin_interfaces/msg/Time"]
Header = types["std_msgs/msg/Header"]
Vector = types["geometry_msgs/msg/Vector3"]
Point = types["geometry_msgs/msg/Point"]
Quaternion = types["geometry_msgs/msg/Quaternion"]

START_NS = 1_700_000_000_000_000_000
LATE_NS = 3_000_000


def header(ns, frame):
    return Header(stamp=Time(sec=ns // 10**9, nanosec=ns % 10**9), frame_id=frame)


def messages():
    """Topic, type, time, message; the recorder's time is LATE_NS later."""
    joint = types["sensor_msgs/msg/JointState"]
    wrench = types["geometry_msgs/msg/WrenchStamped"]
    point = types["geometry_msgs/msg/PointStamped"]
    placed = types["geometry_msgs/msg/TransformStamped"]
    for k in range(401):
        ns = START_NS + k * 10_000_000
        t = 0.01 * k
        yield "/joint_states", joint, ns, joint(
            header=header(ns, ""),
            # The order of the joints is the robot's, not ours.
            name=["roll_joint", "gripper", "feed.motor"],
            position=np.array([0.5 * t, 9.0, 2 * math.pi * t]),
            velocity=np.array([0.5, 0.0, 2 * math.pi]),
            effort=np.array([0.0, 0.0, 1.5]),
        )
    for k in range(801):
        ns = START_NS + 2_000_000 + k * 5_000_000
        yield "/ft_sensor/wrench", wrench, ns, wrench(
            header=header(ns, "ft_link"),
            wrench=types["geometry_msgs/msg/Wrench"](
                force=Vector(x=0.1, y=-0.2, z=0.3 + 0.001 * k),
                torque=Vector(x=1.0, y=2.0, z=3.0),
            ),
        )
    for k in range(101):
        ns = START_NS + k * 40_000_000
        x = 0.001 * k
        yield "/tip", point, ns, point(header=header(ns, "vessel"), point=Point(x=x, y=0.002, z=-0.003))
        frame = placed(
            header=header(ns, "vessel"),
            child_frame_id="catheter_tip",
            transform=types["geometry_msgs/msg/Transform"](
                translation=Vector(x=x, y=0.002, z=-0.003), rotation=Quaternion(x=0, y=0, z=0, w=1)
            ),
        )
        kind = types["tf2_msgs/msg/TFMessage"]
        yield "/tf", kind, ns, kind(transforms=[frame])


def write(path, plugin, packed):
    writer = Writer(path, version=9, storage_plugin=plugin)
    if packed is not None:
        writer.set_compression(packed, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        ordered = sorted(messages(), key=lambda one: one[2])
        for k, (topic, kind, ns, message) in enumerate(ordered):
            name = kind.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=store)
            data = store.serialize_cdr(message, name, little_endian=k % 3 != 0)
            writer.write(connections[topic], ns + LATE_NS, data)


def main():
    folder = Path(sys.argv[1])
    write(folder / "sqlite", StoragePlugin.SQLITE3, None)
    write(folder / "mcap", StoragePlugin.MCAP, None)
    write(folder / "packed", StoragePlugin.SQLITE3, CompressionMode.MESSAGE)
    write(folder / "storage", StoragePlugin.MCAP, CompressionMode.STORAGE)
    write(folder / "file", StoragePlugin.SQLITE3, CompressionMode.FILE)
    print(json.dumps({"bags": sorted(entry.name for entry in folder.iterdir())}))


main()
