"""What a field shows is what counts: text that was typed while the connection was away has never reached the page's server."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

from nicegui import ui

from xy_sysid.errors import XySysidError

WAIT = 5.0  # s for the browser to answer
READ = """return Object.fromEntries(%s.map(id => {
    const field = getElement(id), box = field && ((field.$refs && field.$refs.qRef) || field).nativeEl;
    return [id, box ? box.value : null];
}))"""


async def take_over(fields: Iterable[Any]) -> None:
    """Give text and number fields the values that the browser shows in them; others have only values that the server gave.

    Called in the browser's context. Raises XySysidError when the browser does not answer.
    """
    typed: dict[str, Any] = {str(field.id): field for field in fields if isinstance(field, (ui.input, ui.number))}
    try:
        shown = await ui.run_javascript(READ % json.dumps([int(one) for one in typed]), timeout=WAIT)
    except TimeoutError:
        raise XySysidError(f"The browser did not answer within {WAIT:g} s, so that what it shows is not known. Press again.") from None
    for one, text in shown.items():
        if text is not None:
            typed[one].set_value(_number(text) if isinstance(typed[one], ui.number) else text)


def _number(text: str) -> float | None:
    return float(text) if text else None
