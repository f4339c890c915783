"""Names that come from data are names: never paths, and never more than a file's name can hold."""

from __future__ import annotations

import re
import unicodedata

from ..errors import SceneError

LONGEST = 120
ALLOWED = f"it must be a name: letters, digits, spaces and _ - + = , . inside, at most {LONGEST} characters"


def name(field: str, value: object) -> str:
    """A text that may be part of a file's name.

    >>> name("name", "strip_footing")
    'strip_footing'

    Raises:
        SceneError: it is no text, leads elsewhere (a slash, `..`), or begins or ends otherwise than a word.
    """
    if not isinstance(value, str) or len(value) > LONGEST or not re.fullmatch(r"\w([\w .=,+-]*\w)?", value):
        raise SceneError(field, value, ALLOWED)
    return value


def printable(field: str, text: str) -> str:
    """A text of the command line that can be written into files and messages as it is.

    Raises:
        SceneError: it holds a line break or another control character, or bytes that are not UTF-8.
    """
    for character in text:
        if unicodedata.category(character) in ("Cc", "Cs"):
            raise SceneError(field, text, "it must be UTF-8 without control characters")
    return text
