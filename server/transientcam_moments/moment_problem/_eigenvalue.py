"""The smallest eigenvalue of a Hermitian Toeplitz matrix (Sec. 4.3 and 5.1)."""

from transientcam_moments.arrays import (
    Bank,
    Length,
    Mask,
    Plane,
    bank,
    eps,
    larger,
    largest,
    magnitude,
    not_a_number,
    repeat,
    root,
    select,
    small,
    smaller,
    some,
    square_bank,
    tiny,
)

STEPS = 64
"""Of the iteration; six are usual, and a cluster of equal eigenvalues halves the distance each."""


def smallest_eigenvalue(order: Length, re: Bank, im: Bank) -> Plane:
    """Return the smallest eigenvalue of B, for moments of which the largest is 1.

    Householder reflections make a real symmetric matrix of the same eigenvalues tridiagonal, and
    Laguerre's iteration climbs from Gershgorin's bound to the smallest root of its characteristic
    polynomial, which it never passes because all roots are real.
    """
    d, e = bank(re[0], order, 1), bank(re[0], order, 1)
    h = square_bank(re[0], order, 1)
    _fill(order, re, im, h)
    _tridiagonalise(order, h, d, e)
    n = len(order) + 1
    x = d[0] - e[0]
    for i in range(1, n - 1):
        x = smaller(x, d[i] - e[i] - e[i - 1])
    x = smaller(x, d[n - 1] - e[n - 2])
    for i in range(n - 1):
        e[i] = e[i] * e[i]
    x = _nearer(order, d, e, x)
    state = (x <= x, x, x * 0.0)  # NaN does not move
    found: Plane = repeat(climb, STEPS, (order,), (d, e), state)[1]
    return found


def least_zeroth(smallest: Plane, epsilon: Plane | float) -> tuple[Plane, Plane]:
    """Return b_0 and the smallest eigenvalue of B, of the latter with 0 in place of b_0 (4.3)."""
    b0 = smallest / (epsilon - 1.0)
    return b0, epsilon * b0


def margin(
    order: Length, re: Bank, im: Bank, smallest: Plane, epsilon: Plane | float, least: Plane | float
) -> tuple[Mask, Mask, Mask, Plane, Plane, Plane]:
    """Flag and bias moments whose smallest eigenvalue is known (Sec. 4.3).

    Returns where they are finite, finite but without light (b_0 up to ``least``), and biased; the
    smallest eigenvalue over b_0 before that; and b_0 and the smallest eigenvalue after it.
    """
    m = len(order)
    b0 = re[0]
    most, poison = magnitude(b0), b0 * 0.0 + im[0] * 0.0
    for j in range(1, m + 1):
        most = larger(most, larger(magnitude(re[j]), magnitude(im[j])))
        poison = poison + re[j] * 0.0 + im[j] * 0.0
    # so large a density would overflow
    limit = (largest(b0) * eps(b0)) * (6.0 / (2.0 * m + 1.0))
    finite = (poison >= 0.0) & (most < limit)
    dark = finite & ~(b0 > least)
    # less by rounding doesn't count, see `ROUNDING` of `bias`
    biased = smallest < (epsilon - 4.0 * (m + 1.0) * eps(b0)) * b0
    raised = select(biased, (b0 - smallest) / (1.0 - epsilon), b0)
    validity = select(b0 > 0.0, smallest / b0, not_a_number(b0))
    return finite, dark, biased, validity, raised, smallest + (raised - b0)


def _fill(order: Length, re: Bank, im: Bank, h: Bank) -> None:
    """Fill the lower half of the matrix Re b_{j-k} - Im b_{j+k-m}.

    B is unitarily similar to it, by (I + i J) / sqrt 2.
    """
    m = len(order)
    n = m + 1
    for i in range(n):
        for j in range(i + 1):
            k = i + j - m
            h[i * n + j] = re[i - j] - im[k] if k >= 0 else re[i - j] + im[-k]


def _tridiagonalise(order: Length, h: Bank, d: Bank, e: Bank) -> None:
    """Put the diagonal of a symmetric tridiagonal matrix in `d`, those beside it, >= 0, in `e`.

    `h` holds the lower half of a symmetric matrix of the same eigenvalues, and is overwritten.
    """
    n = len(order) + 1
    for i in range(n - 2):
        norm2 = h[(i + 1) * n + i] * h[(i + 1) * n + i]
        for j in range(i + 2, n):
            norm2 = norm2 + h[j * n + i] * h[j * n + i]
        norm = root(norm2)
        first = h[(i + 1) * n + i]
        half = norm2 + magnitude(first) * norm  # v'v / 2
        h[(i + 1) * n + i] = select(first < 0.0, first - norm, first + norm)
        inverse = select(half > small(half), 1.0 / half, 0.0)
        inner = norm * 0.0
        for j in range(i + 1, n):  # row j of p = A v / (v'v / 2), kept in e for the moment
            row = h[j * n + i + 1] * h[(i + 1) * n + i]
            for k in range(i + 2, n):
                row = row + h[max(j, k) * n + min(j, k)] * h[k * n + i]
            e[j] = row * inverse
            inner = inner + e[j] * h[j * n + i]
        inner = inner * inverse * 0.5
        for j in range(i + 1, n):
            e[j] = e[j] - inner * h[j * n + i]
        for j in range(i + 1, n):
            for k in range(i + 1, j + 1):
                h[j * n + k] = h[j * n + k] - h[j * n + i] * e[k] - e[j] * h[k * n + i]
        d[i] = h[i * n + i]
        e[i] = norm
    d[n - 2], d[n - 1] = h[(n - 2) * n + n - 2], h[(n - 1) * n + n - 1]
    e[n - 2] = magnitude(h[(n - 1) * n + n - 2])


def _nearer(order: Length, d: Bank, squares: Bank, bound: Plane) -> Plane:
    """Return a lower bound of a tridiagonal matrix's eigenvalues, up to 64 times nearer to 0.

    A number is below all eigenvalues where all leading minors of T - x I are positive (Sturm). The
    smallest eigenvalue of few returns is next to 0, far from Gershgorin's negative bound: two
    trials take less than the steps of the iteration that they save. A positive bound stays.
    """
    for _ in range(2):
        tried = 0.125 * bound
        minor, before = d[0] - tried, bound * 0.0 + 1.0
        below = (tried > bound) & (minor > 0.0)
        for k in range(1, len(order) + 1):
            minor, before = (d[k] - tried) * minor - squares[k - 1] * before, minor
            below = below & (minor > 0.0)
        bound = select(below, tried, bound)
    return bound


def climb(
    first: bool, fixed: tuple[Length], given: tuple[Bank, Bank], state: tuple[Mask, Plane, Plane]
) -> tuple[Mask, Plane, Plane]:
    """Take a step of Laguerre's iteration from below to the smallest root of det(T - x I).

    ``given`` holds T's diagonal and the squares of what is beside it; the state is x and the size
    of the last step.
    """
    n = len(fixed[0]) + 1
    d, squares = given
    moving, x, last = state
    # p = det(T - x I) and its first two derivatives by the recurrence over leading blocks
    p0, q0, r0 = x * 0.0 + 1.0, x * 0.0, x * 0.0
    p1, q1, r1 = d[0] - x, q0 - 1.0, r0
    for k in range(1, n):
        t = d[k] - x
        p2 = t * p1 - squares[k - 1] * p0
        q2 = t * q1 - p1 - squares[k - 1] * q0
        r2 = t * r1 - 2.0 * q1 - squares[k - 1] * r0
        p0, q0, r0, p1, q1, r1 = p1, q1, r1, p2, q2, r2
        if n > 5 and k % 2 == 0:  # many equal eigenvalues: only quotients matter, p would vanish
            size = larger(magnitude(p0), magnitude(p1))
            vanishing = size < eps(x) * eps(x)
            if some(vanishing):
                factor = select(vanishing, 1.0 / larger(size, tiny(x)), 1.0)
                p0, q0, r0 = p0 * factor, q0 * factor, r0 * factor
                p1, q1, r1 = p1 * factor, q1 * factor, r1 * factor
    inverse = 1.0 / p1
    g = q1 * inverse
    radicand = (n - 1.0) * ((n - 1.0) * g * g - n * r1 * inverse)
    # NaN is what very small determinants leave: no step
    upwards = n / (root(select(radicand > 0.0, radicand, 0.0)) - g)
    left, past = (p1 > 0.0) & (q1 < 0.0), (p1 < 0.0) & (q1 < 0.0)
    step = select(left, upwards, 0.0)
    if some(past):  # rounding may carry the last step past the root: Newton's comes back
        step = select(past, larger(-1.0 / g, -0.25 * last), step)
    # a pixel that has arrived stays, however long its neighbours take
    x = select(moving, x + step, x)
    last = magnitude(step)
    return moving & (last > 2.0 * eps(x)), x, last
