"""Text from a file or from the network on a terminal: it is shown, and it never steers the terminal.

A column, a joint or a file may be named with an escape sequence. Printed as it is, such a name could set the window's title,
overwrite what stands above it, or reorder the characters of a line. Each such character is shown as one other character, so
that tables stay aligned.
"""

from __future__ import annotations

LAYOUT = "\t\n"  # what lines are made of
PICTURES = 0x2400  # U+2400 and those after it picture the characters 0 to 31
DELETE, PICTURE_OF_DELETE = 0x7F, 0x2421
UNKNOWN = 0xFFFD
SECOND_CONTROLS = range(0x80, 0xA0)  # a terminal takes 0x9B for an escape sequence's begin
REORDERING = (0x061C, 0x200E, 0x200F, 0x2028, 0x2029, *range(0x202A, 0x202F), *range(0x2066, 0x206A))  # direction marks, and line ends of Unicode

SHOWN = {code: PICTURES + code for code in range(0x20) if chr(code) not in LAYOUT}
SHOWN |= {DELETE: PICTURE_OF_DELETE, **dict.fromkeys((*SECOND_CONTROLS, *REORDERING), UNKNOWN)}


def printable(text: str) -> str:
    """The text with every character that would steer a terminal replaced by one that shows it; as long as before."""
    return text.translate(SHOWN)
