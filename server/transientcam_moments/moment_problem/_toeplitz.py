"""Levinson's recursion over the leading blocks of a Hermitian Toeplitz matrix (Theorem 1).

At order k it has the predictor polynomial a (a_0 = 1), the error E and adds one reflection
coefficient g, |g| < 1 as long as B is positive definite (Prop. 1). Banks of moments begin with b_0,
those of polynomials with room for a_0 = 1, which is not kept.
"""

from transientcam_moments.arrays import (
    Bank,
    Length,
    Mask,
    Pair,
    Plane,
    eps,
    large,
    larger,
    lost_by_squaring,
    magnitude,
    root,
    select,
    small,
    smaller,
    some,
    tiny,
)


def relative(order: Length, re: Bank, im: Bank) -> Plane:
    """Divide moments by the largest of them and return that one, which is b_0 if they are physical.

    A pixel of zeros stays zero. One with a NaN or an infinity becomes NaN in all of its moments.
    """
    m = len(order)
    scale, poison = magnitude(re[0]), re[0] * 0.0
    for j in range(1, m + 1):
        poison = poison + re[j] * 0.0 + im[j] * 0.0
        scale = larger(scale, larger(magnitude(re[j]), magnitude(im[j])))
    scale = scale + poison
    # the reciprocal of tiny and huge pixels would leave the exponent range: into its middle first
    low, high = scale < small(scale), scale > large(scale)
    near = scale
    if some(low | high):
        lift = select(low, large(scale), select(high, small(scale), 1.0))
        near = scale * lift
        for j in range(m + 1):
            re[j], im[j] = re[j] * lift, im[j] * lift
    lit = near > 0.0  # the derivative of a quotient that isn't taken must be finite, too
    inverse = select(lit, 1.0 / select(lit, near, 1.0), near)
    for j in range(m + 1):
        re[j], im[j] = re[j] * inverse, im[j] * inverse + poison
    return scale


def physical(order: Length, re: Bank, im: Bank) -> None:
    """Divide by b_0 where it isn't the largest moment, and bound moments by 2 b_0.

    |b_k| <= b_0 for every density; a pixel that breaks this is projected onto the border of the
    cone anyway, and only the direction of b_k still counts. Without light all moments become zero.
    """
    b0 = re[0]
    if some(~(b0 >= 1.0)):
        lit = b0 > 4.0 * tiny(b0)
        inverse = select(lit, 1.0 / select(lit, b0, 1.0), 0.0 * b0)
        re[0] = b0 * inverse
        for k in range(1, len(order) + 1):
            square = re[k] * re[k] + im[k] * im[k]
            size = root(larger(square, tiny(square)))
            factor = select(size > 2.0 * b0, 2.0 / size, inverse)
            factor = select(re[0] > 0.0, factor, 0.0 * b0)
            re[k], im[k] = re[k] * factor, im[k] * factor


def step_up(k: int, ar: Bank, ai: Bank, gr: Plane, gi: Plane) -> None:
    """Raise the order of a polynomial to k: a_j + g conj(a_{k-j}), a_k = g (Durbin)."""
    for j in range(1, k // 2 + 1):  # a_j and a_{k-j} together
        ur, ui, vr, vi = ar[j], ai[j], ar[k - j], ai[k - j]
        ar[j], ai[j] = ur + gr * vr + gi * vi, ui + gi * vr - gr * vi
        ar[k - j], ai[k - j] = vr + gr * ur + gi * ui, vi + gi * ur - gr * ui
    ar[k], ai[k] = gr, gi


def reflect(k: int, re: Bank, im: Bank, ar: Bank, ai: Bank, inverse: Plane) -> Pair:
    """Return g_k = -(b_k + sum_{0<j<k} a_j b_{k-j}) / E_{k-1}; ``inverse`` is 1 / E_{k-1}."""
    x, y = re[k], im[k]
    for j in range(1, k):
        x = x + ar[j] * re[k - j] - ai[j] * im[k - j]
        y = y + ar[j] * im[k - j] + ai[j] * re[k - j]
    return -x * inverse, -y * inverse


def below_one(x: Plane, y: Plane) -> Plane:
    """Return 1 - |g|^2 of g = x + i y with an error relative to itself, also where |g| is near 1.

    What rounding takes from the squares is put back. Computed naively the difference has the
    absolute error of |g|^2, which close to the border of the disc is all of it: errors and
    polynomials of the recursion would no longer belong to each other.
    """
    xx, yy = x * x, y * y
    lost = lost_by_squaring(x, xx) + lost_by_squaring(y, yy)
    above, below = larger(xx, yy), smaller(xx, yy)
    rest = 1.0 - above
    return (rest - below) + (((1.0 - rest) - above) - lost)


def least_modulus(order: Length, gr: Bank, gi: Bank) -> Plane:
    """Return the least of Eq. (2)'s denominators above rounding: eps prod (1 - |g_k|^2)."""
    product = eps(gr[0]) * below_one(gr[0], gi[0])
    for k in range(1, len(order)):
        product = product * below_one(gr[k], gi[k])
    return product


def levinson(order: Length, re: Bank, im: Bank, ar: Bank, ai: Bank, gr: Bank, gi: Bank) -> Plane:
    """Fill a_1 .. a_m and g_1 .. g_m from moments with b_0 = 1, and return E_m.

    Levinson's and Durbin's steps, which end with E_m B^-1 e_0 = a (Theorem 1). Where E_k would fall
    to 4 eps or below, the border of the cone, g_k is projected into the disc and all later ones are
    zero: what comes out is always a valid positive density. A pixel without light, whose moments
    are all zero, has E_m = 0.
    """
    light = re[0]
    dark = ~(light > 0.0)
    error = select(dark, 1.0, light)  # E_0 = b_0
    floor = 4.0 * eps(error)
    alive = error > 0.0
    for k in range(1, len(order) + 1):
        x, y = reflect(k, re, im, ar, ai, 1.0 / error)
        remaining = error * below_one(x, y)  # E_k = E_{k-1} (1 - |g_k|^2)
        inside = remaining > floor
        if some(~inside | ~alive):
            onto = _onto_border(x, y, error, floor, inside)
            # NaN belongs to an invalid pixel, which keeps it
            x = select(alive, x * onto, 0.0 * re[k])
            y = select(alive, y * onto, 0.0 * im[k])
            remaining = select(inside, remaining, error * below_one(x, y))
            remaining = select(alive, remaining, error)
            alive = alive & inside
        step_up(k, ar, ai, x, y)
        gr[k - 1], gi[k - 1] = x, y
        error = remaining
    return select(dark, 0.0 * light, error)


def definite(
    order: Length,
    re: Bank,
    im: Bank,
    floor: Plane,
    ar: Bank,
    ai: Bank,
    gr: Bank,
    gi: Bank,
    inverse: Bank,
) -> Mask:
    """Do as `singular` does, but for definite smaller blocks; return where one is singular."""
    m = len(order)
    error = re[0]
    fewer = error < error
    for k in range(1, m + 1):
        inverse[k - 1] = 1.0 / error
        x, y = reflect(k, re, im, ar, ai, inverse[k - 1])
        if k < m:
            error = error * below_one(x, y)
            fewer = fewer | ~(error > floor)
        else:  # E_m = 0: a is the eigenvector of the smallest eigenvalue (Sec. 5.1)
            unit = 1.0 / root(x * x + y * y)
            x, y = x * unit, y * unit
        step_up(k, ar, ai, x, y)
        gr[k - 1], gi[k - 1] = x, y
    return fewer


def singular(
    order: Length,
    re: Bank,
    im: Bank,
    floor: Plane,
    ar: Bank,
    ai: Bank,
    gr: Bank,
    gi: Bank,
    inverse: Bank,
) -> Plane:
    """Do as `levinson` does for a singular B with b_0 = 1, up to |g| = 1 (Theorem 2).

    Fills the eigenvector a of the eigenvalue 0, g_1 .. g_m, and 1 / E_0 .. 1 / E_{m-1} in
    ``inverse``. Returns the order n of the smallest block that is singular, but for ``floor``: from
    there on all a and g are zero.
    """
    m = len(order)
    error = re[0]
    degree = 0.0 * error + float(m)
    alive = degree > 0.0
    for k in range(1, m + 1):
        inverse[k - 1] = 1.0 / error
        x, y = reflect(k, re, im, ar, ai, inverse[k - 1])
        remaining = error * below_one(x, y)
        ends = alive
        if k < m:
            ends = alive & ~(remaining > floor)
        if some(ends | ~alive):
            square = x * x + y * y
            unit = 1.0 / root(larger(square, tiny(square)))
            u, v = select(square <= 0.0, 1.0, x * unit), y * unit
            x = select(alive, select(ends, u, x), 0.0)
            y = select(alive, select(ends, v, y), 0.0)
            degree = select(ends, float(k), degree)
            alive = alive & ~ends
            remaining = select(alive, remaining, error)
        step_up(k, ar, ai, x, y)
        gr[k - 1], gi[k - 1] = x, y
        error = remaining
    return degree


def _onto_border(x: Plane, y: Plane, error: Plane, floor: Plane, inside: Mask) -> Plane:
    """Return what to multiply g with so that E_k is ``floor`` (but for what is inside)."""
    square = x * x + y * y
    rest = 1.0 - floor / error
    # derivatives of what isn't taken must be finite, too
    size = root(larger(rest, eps(rest))) / root(larger(square, tiny(square)))
    return select(inside, 1.0, size)
