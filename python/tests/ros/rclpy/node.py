from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from .time import Time

Message = TypeVar("Message")


@dataclass
class Parameter:
    value: Any


@dataclass
class Publisher(Generic[Message]):
    published: list[Message] = field(default_factory=list)

    def publish(self, message: Message) -> None:
        self.published.append(message)


@dataclass
class Clock:
    time: Time = field(default_factory=Time)

    def now(self) -> Time:
        return self.time


@dataclass
class Logger:
    lines: list[str] = field(default_factory=list)

    def info(self, line: str) -> None:
        self.lines.append(line)

    def warning(self, line: str) -> None:
        self.lines.append(line)


class Node:
    parameters: dict[str, Any] = {}

    def __init__(self, name: str) -> None:
        self.clock, self.logger = Clock(), Logger()

    def declare_parameter(self, name: str, default: Any) -> Parameter:
        return Parameter(self.parameters.get(name, default))

    def create_subscription(
        self, kind: type[Message], topic: str, callback: Callable[[Message], None], depth: int
    ) -> object:
        return callback

    def create_publisher(self, kind: type[Message], topic: str, depth: int) -> Publisher[Message]:
        return Publisher()

    def create_timer(self, period: float, callback: Callable[[], None]) -> object:
        return callback

    def get_clock(self) -> Clock:
        return self.clock

    def get_logger(self) -> Logger:
        return self.logger

    def destroy_node(self) -> None: ...
