from dataclasses import dataclass, field

from std_msgs.msg import Header


@dataclass
class AckermannDrive:
    steering_angle: float = 0.0
    speed: float = 0.0
    acceleration: float = 0.0


@dataclass
class AckermannDriveStamped:
    header: Header = field(default_factory=Header)
    drive: AckermannDrive = field(default_factory=AckermannDrive)
