"""The one exception type of PyBullet."""


class error(Exception):  # noqa: N801 (PyBullet's own name)
    """What PyBullet's functions raise as `pybullet.error`."""
