from dataclasses import dataclass, field

from geometry_msgs.msg import TwistWithCovariance


@dataclass
class Odometry:
    twist: TwistWithCovariance = field(default_factory=TwistWithCovariance)
