"""The one exception type of PyBullet."""


class error(Exception):  # PyBullet's own name
    """What PyBullet's functions raise as `pybullet.error`."""

    def __init__(self, message: str = "", reason: str = "") -> None:
        super().__init__(message)
        # Why the daemon refused, as its API names it; empty where the daemon was not asked.
        self.reason = reason


def unsupported(function: str, why: str) -> NotImplementedError:
    """What a function raises that cannot be done (yet)."""
    return NotImplementedError(f"simd_client.pybullet.{function}: {why}")
