"""What examples/ros2_node.py uses of ROS 2, in as few lines as its types and a test need: nothing is sent anywhere."""

from .node import Node


def init() -> None: ...


def spin(node: Node) -> None: ...


def shutdown() -> None: ...
