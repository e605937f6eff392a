"""Reasons why a URI leads to no file."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from pathlib import Path


class Why(Enum):
    """Reason why a URI does not lead to a file."""

    MISSING = "missing"
    EMPTY = "empty"
    XACRO = "xacro"
    NULL = "null"
    NETWORK = "network"
    SCHEME = "scheme"
    NO_FILE = "no_file"
    NO_PACKAGE = "no_package"
    WINDOWS = "windows"
    CLIMBS_OUT = "climbs_out"
    ABSOLUTE_OUTSIDE = "absolute_outside"
    LINK_LEADS_OUT = "link_leads_out"
    NOT_A_MESH = "not_a_mesh"
    AMBIGUOUS = "ambiguous"

    @property
    def phrase(self) -> str:
        """Rest of a sentence that begins with the URI."""
        return _PHRASES[self]


_PHRASES = {
    Why.MISSING: "names a file that does not exist",
    Why.EMPTY: "is empty",
    Why.XACRO: "is an unexpanded xacro expression: run `xacro` on the file first",
    Why.NULL: "holds a null character",
    Why.NETWORK: "is a network address, and nothing is fetched from the network",
    Why.SCHEME: "has a scheme other than package, model and file",
    Why.NO_FILE: "names a package and no file in it",
    Why.NO_PACKAGE: "names no package",
    Why.WINDOWS: "is a path on a Windows disk, which other machines do not have",
    Why.CLIMBS_OUT: "climbs out of the robot's package with `..`",
    Why.ABSOLUTE_OUTSIDE: "is an absolute path outside of the robot's package",
    Why.LINK_LEADS_OUT: "leads out of the robot's package through a symbolic link",
    Why.NOT_A_MESH: "is not a mesh or an image by its name",
    Why.AMBIGUOUS: "fits several files that differ only in capital letters",
}


class Missing(LookupError):
    """No file exists for a URI."""

    def __init__(self, uri: str, why: Why, places: Sequence[Path] = ()) -> None:
        self.uri = uri
        self.why = why
        self.places = tuple(places)
        """Paths that were tried, in order."""
        searched = "; searched " + ", ".join(map(str, self.places)) if self.places else ""
        super().__init__(self.reason + searched)

    @property
    def reason(self) -> str:
        """A sentence that names the URI, without the places."""
        return f"no file for `{self.uri}`" if self.why is Why.MISSING else f"`{self.uri}` {self.why.phrase}"

    def places_for_report(self) -> list[str]:
        """Returns the text for the load report, after "looked in". For an existing file that may not be sent,
        it says so."""
        places = [str(place) for place in self.places]
        if not places:
            return [f"no place, because {self.reason}"]
        if self.why is not Why.MISSING:
            places[-1] += f" (refused: {self.reason})"
        return places
