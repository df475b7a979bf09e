"""Template of the filter across a gap, into which ``filter_source`` writes the laws of dry friction.

Two masses with contact across a gap: an extended Kalman filter on the motor's position. State: motor
position (x) and speed (v), motor minus table (d), its rate (w). The contact force is k depth (1 + loss speed) + c speed and never
pulls (Hunt & Crossley, J. Appl. Mech. 42, 1975, eq. 8); k is constant, or grows with the root of the depth (Hertz), or a mixture.
The given laws of dry friction act on the motor, Coulomb friction on the table; the deflection of bristles follows the motor's position
and is corrected with it (the filter: Jazwinski, Stochastic Processes and Filtering Theory, 1970, sec. 8.3).

Each sub-step of a sample's two pieces of constant voltage is half a drift, a kick and half a drift (leapfrog; Hairer, Lubich &
Wanner, Acta Numerica 12, 2003), the kick linearly implicit in the speeds: stable while the phase of the contact advances by less than
2 rad, with any damping and friction. The covariance takes the same steps.

Derivatives come from the same recursion, differentiated at constant filter gain: changes of the covariance by a parameter
are neglected. (Near the optimum their angle to finite differences is below 0.1; derivatives of the covariance would cost about ten
times as much.)
"""

from __future__ import annotations

from string import Template

TEMPLATE = Template("""\
@law
def level_of(q, v, direction):
    return $level


@law
def force_of(q, z, v):
    return $force


@law
def bent(q, z, v, h):
    return $bent


@law
def rubbed(q, z, v):
$rubbed


@law
def ridden(q, before, after, v, h):
    if abs(v) * h > 1e-11:
        return (after - before) / (v * h)
    return (bent(q, before, math.copysign($slow, v), 1e-9 / $slow) - before) * math.copysign(1e9, v)


def $name(u, y, against, q, fs, noise, drift, cuts, moved_u, moved_y, moved_f, column, nudge, out, slopes):
    n, count, taken, frictions = out.shape[0], slopes.shape[1], column.shape[0], nudge.shape[0]
    sloped = slopes.shape[0] > 0
    gain, delay, pole, gap, share, rate, damping, loss, guide = q[0], q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8]
    hertz, stuck = q[9], q[10]
    reduced = share * (1.0 - share)
    k, c = reduced * rate * rate, 2.0 * reduced * damping * rate
    turn = math.copysign(1.0, gain)
    per_volt, per_net = pole * abs(gain), pole * gain
    drag_motor, drag_table = pole * (1.0 - guide), pole * guide
    per_motor, per_table = 1.0 / share, 1.0 / (1.0 - share)
    uneven = (1.0 - 2.0 * share) / reduced
    half = 0.5 * gap
    late = delay * fs
    whole = int(late)
    part = late - whole
    p = (noise, 0.0, 0.0, 0.0, 1e-8, 0.0, 0.0, half * half + 1e-14, 0.0, 1e-8)
    x, v, d, w, z, zm = y[0], 0.0, 0.0, 0.0, 0.0, 0.0
    rho, rub, slip, spring, follows, rubbing = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    sx, sv, sd, sw, sz = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
    to_v, to_w, to_z = np.zeros(count), np.zeros(count), np.zeros(count)
    fine = 1e-6 * abs(bent(q, 0.0, $slow, 1e-3)) + 1e-300
    for i in range(n):
        for piece in range(2):
            length = part if piece == 0 else 1.0 - part
            steps = max(math.ceil(cuts * length), 1)
            h = length / fs / steps
            at = i - whole - 1 + piece
            volts = u[at] if at >= 0 else 0.0
            if sloped and piece == 1:
                jump = per_net * ((u[at - 1] if at >= 1 else 0.0) - volts) * per_motor
                sv[1] += jump
                sw[1] += jump
            if h <= 0.0:
                continue
            net = volts - against[0, i]
            push, hold = per_net * net, per_net * against[1, i]
            for _ in range(steps):
                dm = d + 0.5 * h * w
                force, by_d, by_w = contact(dm, w, half, k, c, loss, hertz)
                if $bristled:
                    before = z
                    zm = bent(q, z, v, 0.5 * h)
                if $rubs:
                    rho, slip, spring = rubbed(q, zm, v)
                    rub, slip, spring = per_volt * rho, per_volt * slip, per_volt * spring
                turned = smooth_sign(v - w, $slow)
                dragged = drag_table + per_volt * stuck * (1.0 - turned * turned) / $slow
                a = (push - rub - drag_motor * v - force) * per_motor
                r = a - (force - drag_table * (v - w) - per_volt * stuck * turned - hold) * per_table
                v_v, v_d, v_w = -(drag_motor + slip) * per_motor, -by_d * per_motor, -by_w * per_motor
                w_v, w_d, w_w = v_v + dragged * per_table, v_d - by_d * per_table, v_w - (by_w + dragged) * per_table
                g = 0.5 * h
                one, two = 1.0 - g * v_v, 1.0 - g * w_w
                over = h / (one * two - g * g * v_w * w_v)
                of_vv, of_vw, of_wv, of_ww = over * two, over * g * v_w, over * g * w_v, over * one
                kick_v, kick_w = of_vv * a + of_vw * r, of_wv * a + of_ww * r
                vm, wm = v + 0.5 * kick_v, w + 0.5 * kick_w
                v_x = 0.0
                if $bristled:
                    z = bent(q, before, vm, h)
                    follows = ridden(q, before, z, vm, h)
                    v_x = -spring * follows * per_motor
                if sloped:
                    a, on_table = kick_v / h, (kick_v - kick_w) / h / per_table
                    force += by_w * (wm - w)
                    turned += (1.0 - turned * turned) / $slow * (vm - wm - v + w)
                    for b in range(count):
                        to_v[b], to_w[b] = 0.0, 0.0
                    for b in range(taken):
                        change = per_net * ((moved_u[b, at] if at >= 0 else 0.0) - moved_f[b, 0, i]) * per_motor
                        to_v[column[b]] += change
                        to_w[column[b]] += change + per_net * moved_f[b, 1, i] * per_table
                    if $rubs:
                        level, slope, _of_z = rubbed(q, zm, v)
                        rubbing = level + slope * (vm - v)
                    change = pole * (net - turn * rubbing) * per_motor
                    to_v[0] += change
                    to_w[0] += change + pole * (against[1, i] + turn * stuck * turned) * per_table
                    change = (gain * net - abs(gain) * rubbing - (1.0 - guide) * vm) * per_motor
                    to_v[2] += change
                    to_w[2] += change + (guide * (vm - wm) + gain * against[1, i] + abs(gain) * stuck * turned) * per_table
                    change = -a * per_motor
                    to_v[4] += change
                    to_w[4] += change - on_table * per_table * per_table
                    change = pole * vm * per_motor
                    to_v[8] += change
                    to_w[8] += change + pole * (vm - wm) * per_table
                    to_w[10] += per_volt * turned * per_table
                    if force != 0.0:
                        both = per_motor + per_table
                        side = 1.0 if dm > 0.0 else -1.0
                        depth = abs(dm) - half
                        damped = c * wm
                        losses = 1.0 + loss * side * wm
                        stiffer = math.sqrt(depth / half)
                        change = 0.5 * side * (by_d + 0.5 * k * hertz * depth / half * stiffer * losses)
                        to_v[3] += change * per_motor
                        to_w[3] += change * both
                        change = -force * uneven
                        to_v[4] += change * per_motor
                        to_w[4] += change * both
                        change = -(2.0 * force - damped) / rate
                        to_v[5] += change * per_motor
                        to_w[5] += change * both
                        change = -2.0 * reduced * rate * wm
                        to_v[6] += change * per_motor
                        to_w[6] += change * both
                        change = -k * depth * (1.0 - hertz + hertz * stiffer) * wm
                        to_v[7] += change * per_motor
                        to_w[7] += change * both
                        change = -side * k * depth * (stiffer - 1.0) * losses
                        to_v[9] += change * per_motor
                        to_w[9] += change * both
                    if $rubs:
                        for b in range(frictions):
                            kept = q[$first + b]
                            q[$first + b] = kept + nudge[b]
                            level, slope, _of_z = rubbed(q, zm, v)
                            change = -per_volt * (level + slope * (vm - v) - rubbing) / nudge[b] * per_motor
                            if $bristled:
                                to_z[$first + b] = (bent(q, before, vm, h) - z) / nudge[b]
                            q[$first + b] = kept
                            to_v[$first + b] += change
                            to_w[$first + b] += change
                    if $bristled:
                        by_z = (bent(q, before + fine, vm, h) - z) / fine
                        of_v = (bent(q, before, vm + $nudge, h) - z) / $nudge
                        of_z = -spring * per_motor
                        for b in range(count):
                            after = by_z * sz[b] + of_v * sv[b] + to_z[b]
                            to_v[b] += of_z * 0.5 * (sz[b] + after)
                            to_w[b] += of_z * 0.5 * (sz[b] + after)
                            sz[b] = after
                    for b in range(count):
                        vv, ww = sv[b], sw[b]
                        dd = sd[b] + g * ww
                        by_v = v_v * vv + v_d * dd + v_w * ww + to_v[b]
                        by_w = w_v * vv + w_d * dd + w_w * ww + to_w[b]
                        more_v, more_w = of_vv * by_v + of_vw * by_w, of_wv * by_v + of_ww * by_w
                        sx[b] += h * (vv + 0.5 * more_v)
                        sd[b] += h * (ww + 0.5 * more_w)
                        sv[b] = vv + more_v
                        sw[b] = ww + more_w
                x, v, d, w = x + h * vm, v + kick_v, d + h * wm, w + kick_w
                to_v_of = (of_vv * v_x + of_vw * v_x, 1.0 + of_vv * v_v + of_vw * w_v, of_vv * v_d + of_vw * w_d, of_vv * v_w + of_vw * w_w)
                to_w_of = (of_wv * v_x + of_ww * v_x, of_wv * v_v + of_ww * w_v, of_wv * v_d + of_ww * w_d, 1.0 + of_wv * v_w + of_ww * w_w)
                p = drifted(kicked(drifted(p, g), to_v_of, to_w_of, drift * h), g)
        xx, xv, xd, xw, vv, vd, vw, dd, dw, ww = p
        seen = xx + noise
        error = y[i + 1] - x
        out[i] = error
        k0, k1, k2, k3 = xx / seen, xv / seen, xd / seen, xw / seen
        if sloped:
            for b in range(count):
                slopes[i, b] = -sx[b]
            for b in range(taken):
                slopes[i, column[b]] += moved_y[b, i + 1] - moved_y[b, 0]
            for b in range(count):
                miss = slopes[i, b]
                sx[b] += k0 * miss
                sv[b] += k1 * miss
                sd[b] += k2 * miss
                sw[b] += k3 * miss
                sz[b] += follows * k0 * miss
        if $bristled:
            z += k0 * error * follows
        x, v, d, w = x + k0 * error, v + k1 * error, d + k2 * error, w + k3 * error
        p = (
            xx - k0 * xx,
            xv - k0 * xv,
            xd - k0 * xd,
            xw - k0 * xw,
            vv - k1 * xv,
            vd - k1 * xd,
            vw - k1 * xw,
            dd - k2 * xd,
            dw - k2 * xw,
            ww - k3 * xw,
        )
""")
