from __future__ import annotations

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.time import Time


class TransformException(Exception): ...


class Buffer:
    def __init__(self) -> None:
        self.found: dict[str, TransformStamped] = {}

    def lookup_transform(self, target_frame: str, source_frame: str, time: Time) -> TransformStamped:
        if source_frame not in self.found:
            raise TransformException(f"{source_frame}: unknown")
        return self.found[source_frame]


class TransformListener:
    def __init__(self, buffer: Buffer, node: Node) -> None: ...
