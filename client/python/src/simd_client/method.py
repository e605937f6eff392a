"""Methods of the schema: names, request messages, answers."""

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from google.protobuf.message import DecodeError

from simd_client.errors import AnswerError


class Message(Protocol):
    """The part of a protobuf message that a call needs."""

    def SerializeToString(self) -> bytes:
        """The message as bytes."""
        ...

    def ParseFromString(self, serialized: bytes, /) -> int:
        """Sets its fields from bytes."""
        ...


Request = TypeVar("Request", bound=Message)
Reply = TypeVar("Reply", bound=Message)


@dataclass(frozen=True)
class Method(Generic[Request, Reply]):
    """A method of `simd.v1`, with its types."""

    key: str
    """`SERVICE/METHOD`, the end of its key on Zenoh."""
    request: type[Request]
    """Type of the request."""
    reply: type[Reply]
    """Type of the answer."""


def decoded(message: type[Reply], payload: bytes) -> Reply:
    """Parses a message from its bytes. Raises `AnswerError` if they are not one."""
    answer = message()
    try:
        answer.ParseFromString(payload)
    except DecodeError as error:
        name = message.__name__
        raise AnswerError(f"the daemon's answer cannot be understood: it is not a {name} ({error})") from error
    return answer
