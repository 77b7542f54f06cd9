from __future__ import annotations

from dataclasses import dataclass

from builtin_interfaces.msg import Time as Message


@dataclass
class Duration:
    nanoseconds: int


@dataclass
class Time:
    nanoseconds: int = 0

    @staticmethod
    def from_msg(message: Message) -> Time:
        return Time(message.sec * 10**9 + message.nanosec)

    def to_msg(self) -> Message:
        return Message(*divmod(self.nanoseconds, 10**9))

    def __sub__(self, other: Time) -> Duration:
        return Duration(self.nanoseconds - other.nanoseconds)
