"""The one exception type of PyBullet."""


class error(Exception):  # PyBullet's own name
    """The exception `pybullet.error`."""

    def __init__(self, message: str = "", reason: str = "") -> None:
        super().__init__(message)
        # Reason of the daemon's refusal, as the schema names it; empty for others.
        self.reason = reason


def unsupported(function: str, why: str) -> NotImplementedError:
    """Returns the exception of a function that is not supported (yet)."""
    return NotImplementedError(f"simd_client.pybullet.{function}: {why}")
