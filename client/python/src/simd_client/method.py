"""What a call is: the name of a method, and the messages that go and come."""

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar


class Message(Protocol):
    """The part of a protobuf message that a call needs."""

    def SerializeToString(self) -> bytes:
        """Its bytes on the wire."""
        ...

    def ParseFromString(self, serialized: bytes, /) -> int:
        """Takes its fields from bytes on the wire."""
        ...


Request = TypeVar("Request", bound=Message)
Reply = TypeVar("Reply", bound=Message)


@dataclass(frozen=True)
class Method(Generic[Request, Reply]):
    """A method of `simd.v1`, with its types."""

    key: str
    """`SERVICE/METHOD`, the end of its key on Zenoh."""
    request: type[Request]
    """The message that goes."""
    reply: type[Reply]
    """The message that comes."""
