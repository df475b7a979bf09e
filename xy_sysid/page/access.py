"""Access control for the page: checks host, origin and token of every request before the application handles it.

Without these checks, any web page that a user has open could press buttons here (cross-site requests and WebSockets have no
same-origin check), or read the answers through a host name that resolves to this machine (DNS rebinding).
"""

from __future__ import annotations

import hmac
import ipaddress
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

from xy_sysid.page.address import without

LARGEST = 1 << 20  # bytes of a request's body; the page itself sends very little
LOOPBACK = ("localhost", "127.0.0.1", "::1")
COOKIE = "xy_sysid_token"
CONTENT = {
    "default-src": "'self'",
    # NiceGUI evaluates event handlers and button answers from strings (static/nicegui.js); without unsafe-eval the page stays empty.
    # plotly.js does not need it.
    "script-src": "'self' 'unsafe-inline' 'unsafe-eval'",
    "style-src": "'self' 'unsafe-inline'",
    "img-src": "'self' data: blob:",  # needed to save figures as PNG
    "font-src": "'self' data:",
    "object-src": "'none'",
    "base-uri": "'none'",
    "form-action": "'self'",
    "frame-ancestors": "'none'",  # as x-frame-options
}
"""Where the browser may take content from, by kind: this server alone, and pictures that the page itself has made."""

HEADERS = {
    "x-frame-options": "DENY",  # so that no other page can frame this one and hide its buttons
    "content-security-policy": "; ".join(f"{kind} {places}" for kind, places in CONTENT.items()),
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
}


@dataclass(frozen=True, slots=True)
class Access:
    """The access rules. token: empty if none is needed; hosts: accepted host names, empty accepts any (only with a token)."""

    token: str = ""
    hosts: tuple[str, ...] = LOOPBACK


@dataclass(frozen=True, slots=True)
class Answer:
    """The decision on a request. 200: accepted, else refused with this text; cookie: to be set; to: redirect target."""

    status: int = 200
    words: str = ""
    cookie: str = ""
    to: str = ""


def rules(host: str, token: str = "") -> Access:
    """The access rules for the address that the server listens on: a token is required unless it is a loopback address."""
    if is_loopback(host):
        return Access(token, LOOPBACK)
    return Access(token or secrets.token_urlsafe(24), ())


def is_loopback(host: str) -> bool:
    """True if only this machine can reach that address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def judge(access: Access, headers: Mapping[str, str], query: str) -> Answer:
    """Accept or refuse a request.

    headers: names in lower case; query: the part of the address after the question mark
    """
    host = headers.get("host", "")
    if access.hosts and name_of(host) not in access.hosts:
        return Answer(403, f"This page is not served under the name {name_of(host)!r}. Open it as http://127.0.0.1 with its port.")
    origin = headers.get("origin", "")
    if origin and not same_origin(origin, host):
        return Answer(403, f"Requests from {origin} are refused: this page accepts requests from itself only.")
    if headers.get("sec-fetch-site", "none") == "cross-site" and headers.get("sec-fetch-mode") != "navigate":
        return Answer(403, "Requests from other sites are refused.")
    length = headers.get("content-length", "0")
    if not (length.isascii() and length.isdigit() and len(length) < 20 and int(length) <= LARGEST):
        return Answer(413, f"Nothing of {length[:40]} bytes is accepted here; {LARGEST} are the most.")
    if not access.token:
        return Answer()
    given = parse_qs(query).get("token", [""])[0]
    if given:
        if not _equal(given, access.token):
            return Answer(401, "Wrong token for this page.")
        rest = without(query, "token")
        return Answer(303, "", access.token, f"/?{rest}" if rest else "/")
    if _equal(cookie_of(headers.get("cookie", "")), access.token):
        return Answer()
    return Answer(401, "A token is needed: open the address that was printed when the page was started.")


def _equal(one: str, other: str) -> bool:
    return hmac.compare_digest(one.encode(), other.encode())


def same_origin(origin: str, host: str) -> bool:
    """True if a page from that origin was served under that Host header."""
    parts = urlsplit(origin)
    return parts.scheme in ("http", "https") and bool(parts.netloc) and parts.netloc.lower() == host.lower()


def name_of(host: str) -> str:
    """The name in a Host header, without port and brackets, in lower case; empty if the header is invalid."""
    try:
        return (urlsplit(f"//{host}").hostname or "").lower()
    except ValueError:
        return ""


def cookie_of(text: str) -> str:
    """The token in a Cookie header."""
    try:
        found = SimpleCookie(text).get(COOKIE)
    except CookieError:
        return ""
    return found.value if found else ""


def set_cookie(token: str) -> str:
    """The header that stores the token in the browser, inaccessible to scripts and to other sites."""
    return f"{COOKIE}={token}; Path=/; HttpOnly; SameSite=Strict"
