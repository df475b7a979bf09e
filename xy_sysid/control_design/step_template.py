"""Templates of one sample of an axis model: the frame, and the motion with drag (FREE), without (PLAIN), with bristles, and with dry friction."""

from __future__ import annotations

from string import Template

TEMPLATE = Template("""\
def $name($signature):
    head = int(s[$head])
$inputs
    s[$first + head] = held
    for piece in range(2):
        cuts = $cuts_old
        h = $h_old
        k = head - $back_old
        if piece == 1:
            cuts = $cuts_new
            h = $h_new
            k = head - $back_new
        if k < 0:
            k = k + $ring
        volts = s[$first + k]
        for _ in range(cuts):
            v = s[1]
            drive = volts
            place = s[0] + 0.5 * h * v
            time = s[$time] + 0.5 * h
            s[$time] = s[$time] + h
$advance
            pull = 0.0
$pulls
            push = drive - pull
$move
    head = head + 1
    if head == $ring:
        head = 0
    s[$head] = head
    x = s[0]
    return $shown
""")

FREE = """\
unfold({a}, {n}, s, push - drag, w)
middle = 0.5 * (v + speed_after({n}, w, h))
drag = 0.0
{drag_middle}
unfold({a}, {n}, s, push - drag, w)
follow({n}, w, h, s)"""

PLAIN = """\
unfold({a}, {n}, s, push, w)
follow({n}, w, h, s)"""

BRISTLED = """\
force = push - drag
{first}
unfold({a}, {n}, s, force, w)
middle = 0.5 * (v + speed_after({n}, w, h))
{bend_first}
drag = 0.0
{drag_middle}
force = push - drag
{forces}
unfold({a}, {n}, s, force, w)
follow({n}, w, h, s)
{bend_last}"""

DRY = """\
needed = push - drag + tug({a}, {n}, s)
direction = 1.0
if v < 0.0 or (v == 0.0 and needed * {turn} < 0.0):
    direction = -1.0
level = 0.0
{rest}
if v == 0.0 and abs(needed) <= level:
    unfold({still}, {n}, s, push - drag, w)
    follow({n}, w, h, s)
else:
    level = 0.0
    {level_start}
    unfold({a}, {n}, s, push - drag - {turn} * direction * level, w)
    middle = 0.5 * (v + speed_after({n}, w, h))
    if middle * direction < 0.0:
        middle = 0.0
    drag = 0.0
    {drag_middle}
    level = 0.0
    {level_middle}
    push = push - drag
    unfold({a}, {n}, s, push - {turn} * direction * level, w)
    if speed_after({n}, w, h) * direction >= 0.0:
        follow({n}, w, h, s)
    else:
        gone = 0.0
        if v != 0.0:
            gone = stops_after({n}, w, h)
            follow({n}, w, gone, s)
            s[1] = 0.0
        needed = push + tug({a}, {n}, s)
        direction = 1.0
        if needed * {turn} < 0.0:
            direction = -1.0
        level = 0.0
        {rest}
        if abs(needed) <= level:
            unfold({still}, {n}, s, push, w)
        else:
            unfold({a}, {n}, s, push - {turn} * direction * level, w)
        follow({n}, w, h - gone, s)"""
