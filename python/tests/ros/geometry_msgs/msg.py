from dataclasses import dataclass, field

from std_msgs.msg import Header


@dataclass
class Vector3:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass
class Quaternion:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


@dataclass
class Transform:
    translation: Vector3 = field(default_factory=Vector3)
    rotation: Quaternion = field(default_factory=Quaternion)


@dataclass
class TransformStamped:
    header: Header = field(default_factory=Header)
    transform: Transform = field(default_factory=Transform)


@dataclass
class Twist:
    linear: Vector3 = field(default_factory=Vector3)


@dataclass
class TwistWithCovariance:
    twist: Twist = field(default_factory=Twist)
