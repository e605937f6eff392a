"""Notes that a script keeps on bodies, links and shapes: addUserData and related functions. They are private
to the script."""

from __future__ import annotations

from .connections import connected
from .errors import error
from .script_state import Note


def addUserData(
    bodyUniqueId: int,
    key: str,
    value: str,
    linkIndex: int = -1,
    visualShapeIndex: int = -1,
    physicsClientId: int = 0,
) -> int:
    """Stores a text on a body, a link or a shape, replacing one with the same key. Returns its number."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "Error in addUserData command.")
    if body.link_name(linkIndex) is None:
        raise error("Error in addUserData command.")
    note = Note(str(key), bodyUniqueId, int(linkIndex), int(visualShapeIndex), str(value))
    notes = world.notes
    number = notes.number(note.full_key)
    if number < 0:
        number = notes.next
        notes.next += 1
    notes.by_number[number] = note
    return number


def removeUserData(userDataId: int, physicsClientId: int = 0) -> None:
    """Deletes a text."""
    if connected(physicsClientId).notes.by_number.pop(userDataId, None) is None:
        raise error("Error in removeUserData command.")


def getUserData(userDataId: int, physicsClientId: int = 0) -> bytes | None:
    """Returns a text; `None` for an unknown number."""
    note = connected(physicsClientId).notes.by_number.get(userDataId)
    return None if note is None else note.value.encode()


def getUserDataId(
    bodyUniqueId: int, key: str, linkIndex: int = -1, visualShapeIndex: int = -1, physicsClientId: int = 0
) -> int:
    """Returns the number of a text; -1 without one."""
    full_key = (str(key), bodyUniqueId, int(linkIndex), int(visualShapeIndex))
    return connected(physicsClientId).notes.number(full_key)


def getNumUserData(bodyUniqueId: int, physicsClientId: int = 0) -> int:
    """Returns the number of texts on a body."""
    return len(_of(physicsClientId, bodyUniqueId))


def getUserDataInfo(bodyUniqueId: int, userDataIndex: int, physicsClientId: int = 0) -> tuple[int, bytes, int, int, int]:
    """Returns number, key, body, link and shape of a text, by its index on the body."""
    found = _of(physicsClientId, bodyUniqueId)
    if not 0 <= userDataIndex < len(found):
        raise error("Could not get user data info.")
    number, note = found[userDataIndex]
    return (number, note.key.encode(), note.body, note.link, note.shape)


def syncUserData(bodyUniqueIds: object = None, physicsClientId: int = 0) -> None:
    """Does nothing: no other client has texts."""
    del bodyUniqueIds
    connected(physicsClientId)


def _of(client: int, body: int) -> list[tuple[int, Note]]:
    return [(number, note) for number, note in connected(client).notes.by_number.items() if note.body == body]


__all__ = [
    "addUserData",
    "getNumUserData",
    "getUserData",
    "getUserDataId",
    "getUserDataInfo",
    "removeUserData",
    "syncUserData",
]
