"""Text from a file or the network for a terminal: it is shown and cannot control the terminal.

The name of a column, a joint or a file may contain an escape sequence. Printed unchanged, it could set the window's title,
overwrite earlier lines, or reorder the characters of a line. Each such character is replaced by one visible character, so
that tables stay aligned.
"""

from __future__ import annotations

LAYOUT = "\t\n"  # allowed control characters: tab and newline
PICTURES = 0x2400  # U+2400 and the following show the characters 0 to 31
DELETE, PICTURE_OF_DELETE = 0x7F, 0x2421
UNKNOWN = 0xFFFD
SECOND_CONTROLS = range(0x80, 0xA0)  # a terminal reads 0x9B as the start of an escape sequence
REORDERING = (0x061C, 0x200E, 0x200F, 0x2028, 0x2029, *range(0x202A, 0x202F), *range(0x2066, 0x206A))  # direction marks, and line ends of Unicode

SHOWN = {code: PICTURES + code for code in range(0x20) if chr(code) not in LAYOUT}
SHOWN |= {DELETE: PICTURE_OF_DELETE, **dict.fromkeys((*SECOND_CONTROLS, *REORDERING), UNKNOWN)}


def printable(text: str) -> str:
    """The text with every control character replaced by a visible one; the length is unchanged."""
    return text.translate(SHOWN)
