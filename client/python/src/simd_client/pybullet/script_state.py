"""State of a script in its process: the window's camera, and notes on bodies."""

from __future__ import annotations

from dataclasses import dataclass, field

from .arguments import ORIGIN, Vector


@dataclass(frozen=True)
class Camera:
    """Pose of the window's camera: degrees, metres."""

    distance: float = 5.0
    yaw: float = 50.0
    pitch: float = -35.0
    target: Vector = ORIGIN
    # Size of the picture, pixels: PyBullet's window.
    width: int = 1024
    height: int = 768
    # Tangent of half the vertical field of view: PyBullet's is 90 degrees.
    tangent: float = 1.0


@dataclass(frozen=True)
class Note:
    """A text on a body, a link or a shape."""

    key: str
    body: int
    link: int
    shape: int
    value: str

    @property
    def full_key(self) -> tuple[str, int, int, int]:
        """Key of a note; each key has one note."""
        return self.key, self.body, self.link, self.shape


@dataclass
class Notes:
    """All notes of one script, by number."""

    by_number: dict[int, Note] = field(default_factory=dict[int, Note])
    next: int = 0

    def forget(self, body: int) -> None:
        """Removes the notes of a deleted body."""
        self.by_number = {number: note for number, note in self.by_number.items() if note.body != body}

    def number(self, full_key: tuple[str, int, int, int]) -> int:
        """Returns the number of the note there; -1 without one."""
        return next((number for number, note in self.by_number.items() if note.full_key == full_key), -1)
