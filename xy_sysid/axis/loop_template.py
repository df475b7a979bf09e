"""Template of the loop, into which ``loop_source`` inserts the laws of the effects.

Three paths: forces that are constant or linear in speed between switching instants, exactly; laws that
are nonlinear in speed, in sub-steps; and an axis with resonances (``resonant_loop``), exactly, and in sub-steps where
laws depend on speed.
``more``, ``begins`` and ``ends`` hold the code for an axis whose position is simulated, not measured.
The second template removes effects from a recording, for one-step prediction of other effects.
"""

from __future__ import annotations

from string import Template

TEMPLATE = Template("""\
def $name(u, x, p, on, fs, fine, start, out${more}):
    n = out.shape[0]
    gain, delay, pole = p[0], p[1], p[2]
$unpack
$flags
$places
    held = u.copy()
$inputs
    rest_forth = rest_back = fixed_forth = fixed_back = 0.0
$levels
    unloaded = fixed_forth, fixed_back, rest_forth, rest_back
    slope_forth = slope_back = 0.0
$slopes
$states
    late = delay * fs
    whole = int(late)
    part = late - whole
    cuts_old, cuts_new = pieces(part, fine / fs if curved else 1.0)
    h_old, h_new = part / fs / cuts_old, (1.0 - part) / fs / cuts_new
    turns = dry or sloped  # forth and back differ
    decay_old, decay_new = math.exp(-pole * h_old), math.exp(-pole * h_new)
    spent_old, spent_new = -math.expm1(-pole * h_old) / pole, -math.expm1(-pole * h_new) / pole
    turn = math.copysign(1.0, gain)  # friction opposes motion, whatever the sign of the gain
    v = start
    hung = False
    top, bottom = np.ones(1), np.ones(1)
$hang
    if hung:
        generator_moving = generator(gain, pole, top, bottom, fs)
        generator_still = resting(generator_moving)
        stiff = fastest(pole, bottom, fs) / ($stiff * fs)
        lighter = generator_moving[1, top.size + 1] / (gain * pole)  # without what hangs on it: sooner does it follow the friction
        wanted = fine * lighter if curved or sloped else fine
        cuts_old, cuts_new = pieces(part, min(max(wanted / fs, stiff), $most * fine) if heeded or curved else 1.0)
        h_old, h_new = part / fs / cuts_old, (1.0 - part) / fs / cuts_new
        size = top.size + 2
        moving = exponentials(generator_moving, h_old, h_new)  # over each piece
        still = exponentials(generator_still, h_old, h_new)
        swung, spare, series = np.zeros(size), np.zeros(size), np.zeros(($terms, size))
        swung[1], swung[2] = start, start / top[0]  # what hangs on it moves along
        for i in range(n):
            moved = 0.0${begins}
            for piece in range(2):
                if piece == 0:
                    h, cuts, middle_of = h_old, cuts_old, 0.5 * part
                else:
                    h, cuts, middle_of = h_new, cuts_new, 0.5 * (1.0 + part)
                if h <= 0.0:
                    continue
                k = i - whole - 1 + piece
                volts = held[k] if k >= 0 else 0.0
                time = place = near = far = pull = 0.0
                if placed:
                    time = (i + middle_of) / fs
                    aside = $gauss * (middle_of if piece == 0 else 1.0 - middle_of)
                    place, near, far = along(x, i, middle_of), along(x, i, middle_of - aside), along(x, i, middle_of + aside)
                if any_pull:
$pulls
                for cut in range(cuts):
                    v = swung[1]
                    drive = volts
                    if any_state:
$advance
                    if loaded:
$loaded_cut
                    net = drive - pull
                    drag = 0.0
$drag_start
                    push = net - drag
                    if not heeded:
                        moved += step(moving, piece, swung, net, spare)
                        continue
                    if not dry and not bristled:
                        middle = 0.5 * (v + ahead(moving, piece, swung, push))
                        drag = 0.0
$drag_free
                        moved += step(moving, piece, swung, net - drag, spare)
                        continue
                    if v != 0.0:
                        direction = 1.0 if v > 0.0 else -1.0
                    else:
                        direction = turn if push + tug(generator_moving, swung) > 0.0 else -turn
                    level = fixed_forth if direction > 0.0 else fixed_back
$level_start
                    if bristled:
$bristle_hung
                        continue
                    plus, minus = (rest_forth, rest_back) if gain > 0.0 else (rest_back, rest_forth)
                    if v == 0.0 and -minus <= push + tug(generator_moving, swung) <= plus:
                        moved += hold(generator_moving, generator_still, still, piece, swung, push, plus, minus, h, series, spare)
                        continue
                    middle = 0.5 * (v + ahead(moving, piece, swung, push - turn * direction * level))
                    if middle * direction < 0.0:
                        middle = 0.0
                    drag = 0.0
$drag_middle
                    push = net - drag
                    level = fixed_forth if direction > 0.0 else fixed_back
$level_middle
                    force = push - turn * direction * level
                    if ahead(moving, piece, swung, force) * direction >= 0.0:
                        moved += step(moving, piece, swung, force, spare)
                    else:
                        moved += stop(generator_moving, generator_still, swung, push, force, plus, minus, h, series)
            out[i] = moved * fs${ends}
    elif not curved:
        # v runs in the direction of the voltage here; forth and back are directions of motion, each with a drag of its own
        v = turn * start
        levels = (fixed_forth, fixed_back) if gain > 0.0 else (fixed_back, fixed_forth)
        forth, back = 1.0 + gain * slope_forth, 1.0 + gain * slope_back
        steeper = (forth, back) if gain > 0.0 else (back, forth)
        sizes, poles = (abs(gain) / steeper[0], abs(gain) / steeper[1]), (pole * steeper[0], pole * steeper[1])
        decays_old = (math.exp(-poles[0] * h_old), math.exp(-poles[1] * h_old))
        decays_new = (math.exp(-poles[0] * h_new), math.exp(-poles[1] * h_new))
        spents_old = (-math.expm1(-poles[0] * h_old) / poles[0], -math.expm1(-poles[1] * h_old) / poles[1])
        spents_new = (-math.expm1(-poles[0] * h_new) / poles[0], -math.expm1(-poles[1] * h_new) / poles[1])
        for i in range(n):
            moved = 0.0${begins}
            for piece in range(2):
                if piece == 0:
                    h, decays, spents, middle_of = h_old, decays_old, spents_old, 0.5 * part
                else:
                    h, decays, spents, middle_of = h_new, decays_new, spents_new, 0.5 * (1.0 + part)
                if h <= 0.0:
                    continue
                k = i - whole - 1 + piece
                drive = volts = held[k] if k >= 0 else 0.0
                if loaded:
$loaded
                    levels = (fixed_forth, fixed_back) if gain > 0.0 else (fixed_back, fixed_forth)
                push = volts
                if any_pull:
                    time = (i + middle_of) / fs
                    aside = $gauss * (middle_of if piece == 0 else 1.0 - middle_of)
                    place, near, far = along(x, i, middle_of), along(x, i, middle_of - aside), along(x, i, middle_of + aside)
                    pull = 0.0
$pulls
                    push = volts - pull
                if not turns:
                    reach = sizes[0] * push
                    moved += reach * h + (v - reach) * spents[0]
                    v = reach + (v - reach) * decays[0]
                    continue
                if v > 0.0 or (v == 0.0 and push > levels[0]):
                    side, way = 0, 1.0
                elif v < 0.0 or push < -levels[1]:
                    side, way = 1, -1.0
                else:
                    continue
                reach = sizes[side] * (push - way * levels[side])
                end = reach + (v - reach) * decays[side]
                if way * end >= 0.0:
                    moved += reach * h + (v - reach) * spents[side]
                    v = end
                    continue
                # it comes to rest within the piece: find when, then see whether it sticks or turns
                gone = min(math.log1p(-v / reach) / poles[side], h)
                moved += reach * gone + v / poles[side]
                v = 0.0
                if push > levels[0]:
                    side, way = 0, 1.0
                elif push < -levels[1]:
                    side, way = 1, -1.0
                else:
                    continue
                reach, left = sizes[side] * (push - way * levels[side]), h - gone
                grown = -math.expm1(-poles[side] * left)
                moved += reach * (left - grown / poles[side])
                v = reach * grown
            out[i] = turn * moved * fs${ends}
    else:
        for i in range(n):
            moved = 0.0${begins}
            for piece in range(2):
                if piece == 0:
                    h, cuts, decay, spent, middle_of = h_old, cuts_old, decay_old, spent_old, 0.5 * part
                else:
                    h, cuts, decay, spent, middle_of = h_new, cuts_new, decay_new, spent_new, 0.5 * (1.0 + part)
                if h <= 0.0:
                    continue
                k = i - whole - 1 + piece
                volts = held[k] if k >= 0 else 0.0
                time = place = near = far = pull = 0.0
                if placed:
                    time = (i + middle_of) / fs
                    aside = $gauss * (middle_of if piece == 0 else 1.0 - middle_of)
                    place, near, far = along(x, i, middle_of), along(x, i, middle_of - aside), along(x, i, middle_of + aside)
                if any_pull:
$pulls
                for cut in range(cuts):
                    drive = volts
                    if any_state:
$advance
                    if loaded:
$loaded_cut
                    net = drive - pull
                    drag = 0.0
$drag_start
                    push = net - drag
                    if not dry and not bristled:
                        middle = v + 0.5 * (gain * push - v) * (1.0 - decay)
                        drag = 0.0
$drag_free
                        reach = gain * (net - drag)
                        moved += reach * h + (v - reach) * spent
                        v = reach + (v - reach) * decay
                        continue
                    if v != 0.0:
                        direction = 1.0 if v > 0.0 else -1.0
                    else:
                        direction = turn if push > 0.0 else -turn
                    level = fixed_forth if direction > 0.0 else fixed_back
$level_start
                    if bristled:
$bristle
                        continue
                    if v == 0.0:
                        level = rest_forth if direction > 0.0 else rest_back
                        if abs(push) <= level:
                            continue
                    middle = v + 0.5 * (gain * (push - turn * direction * level) - v) * (1.0 - decay)
                    if middle * direction < 0.0:
                        middle = 0.0
                    drag = 0.0
$drag_middle
                    push = net - drag
                    level = fixed_forth if direction > 0.0 else fixed_back
$level_middle
                    reach = gain * (push - turn * direction * level)
                    end = reach + (v - reach) * decay
                    if end * direction >= 0.0:
                        moved += reach * h + (v - reach) * spent
                        v = end
                        continue
                    gone = min(math.log1p(-v / reach) / pole, h) if v != 0.0 else 0.0
                    moved += reach * gone + v / pole
                    v = 0.0
                    direction = turn if push > 0.0 else -turn
                    rest = rest_forth if direction > 0.0 else rest_back
                    if abs(push) > rest:
                        reach = gain * (push - turn * direction * rest)
                        left = h - gone
                        grown = -math.expm1(-pole * left)
                        moved += reach * (left - grown / pole)
                        v = reach * grown
            out[i] = moved * fs${ends}
$motions
$encoders
""")

UNDOING = Template("""\
def $name(u, x, p, on, fs, held, where, against):
    n = held.shape[0]
    gain, delay, pole = p[0], p[1], p[2]
$unpack
$flags
$places
    for i in range(n + 1):
        where[i] = x[i]
    through = 1.0
$motions
    for i in range(n):
        held[i] = u[i]
$inputs
$states
    h, late = 1.0 / fs, int(delay * fs + 0.5)
    for i in range(n):
        drive = held[i]
$advance
        held[i] = drive
    for i in range(n):
        volts, pull, time = held[max(i - late, 0)], 0.0, (i + 0.5) / fs
        near, far = along(x, i, 0.5 * (1.0 - $gauss)), along(x, i, 0.5 * (1.0 + $gauss))
$pulls
        against[0, i], pull = pull, 0.0
$loads
        against[1, i] = pull
    return through
""")
