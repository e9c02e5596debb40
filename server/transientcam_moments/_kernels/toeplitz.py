"""What all lanes need of a Hermitian Toeplitz matrix, for one register of pixels at a time.

These are the bodies of the kernels, expanded in place: they take and fill banks of registers,
``order`` is a tuple of length m, and moments are already divided by the largest of them.
"""

from typing import Any

from numba import njit

from transientcam_moments._kernels import simd

_EIGENVALUE_STEPS = 64  # six are usual; a cluster of equal eigenvalues halves the distance each


@njit(forceinline=True, error_model="numpy")
def load_zeroth(one: Any, b: Any, p: int) -> Any:
    """Load the real part of b_0, NaN where its imaginary part isn't finite."""
    b0, rest = simd.load_complex(one, b[0], p)
    return b0 + rest * 0.0


@njit(forceinline=True, error_model="numpy")
def load_relative(order: Any, zeroth: Any, b: Any, p: int, re: Any, im: Any) -> Any:
    """Load moments b_1 .. b_m, divide them and b_0 by the largest of them, and return that one.

    A pixel of zeros stays zero. One with a NaN or an infinity becomes NaN in all of its moments.
    """
    m = len(order)
    re[0] = zeroth
    scale, poison = simd.absolute(zeroth), zeroth * 0.0
    im[0] = poison
    for j in range(1, m + 1):
        re[j], im[j] = simd.load_complex(zeroth, b[j], p)
        poison = poison + re[j] * 0.0 + im[j] * 0.0
        scale = simd.maximum(scale, simd.maximum(simd.absolute(re[j]), simd.absolute(im[j])))
    scale = scale + poison
    # the reciprocal of tiny and huge pixels would leave the exponent range: into its middle first
    low, high = scale < simd.small(scale), scale > simd.large(scale)
    near = scale
    if simd.some(low | high):
        lift = simd.select(low, simd.large(scale), simd.select(high, simd.small(scale), 1.0))
        near = scale * lift
        for j in range(m + 1):
            re[j], im[j] = re[j] * lift, im[j] * lift
    inverse = simd.select(near > 0.0, 1.0 / near, near)
    for j in range(m + 1):
        re[j], im[j] = re[j] * inverse, im[j] * inverse + poison
    return scale


@njit(forceinline=True, error_model="numpy")
def physical(order: Any, re: Any, im: Any) -> None:
    """Divide by b_0 where it isn't the largest moment, and bound moments by 2 b_0.

    |b_k| <= b_0 for every density; where that is broken only the direction of b_k still counts.
    """
    if simd.some(~(re[0] >= 1.0)):
        b0 = re[0]
        inverse = simd.select(b0 > 4.0 * simd.tiny(b0), 1.0 / b0, 0.0 * b0)
        re[0] = b0 * inverse
        for k in range(1, len(order) + 1):
            size = simd.sqrt(re[k] * re[k] + im[k] * im[k])
            factor = simd.select(size > 2.0 * b0, 2.0 / size, inverse)
            factor = simd.select(re[0] > 0.0, factor, 0.0 * b0)
            re[k], im[k] = re[k] * factor, im[k] * factor


@njit(forceinline=True, error_model="numpy")
def step_up(k: int, ar: Any, ai: Any, gr: Any, gi: Any) -> None:
    """Raise the order of a polynomial to k: a_j + g conj(a_{k-j}), a_k = g."""
    for j in range(1, k // 2 + 1):  # a_j and a_{k-j} together (Durbin's update)
        ur, ui, vr, vi = ar[j], ai[j], ar[k - j], ai[k - j]
        ar[j], ai[j] = ur + gr * vr + gi * vi, ui + gi * vr - gr * vi
        ar[k - j], ai[k - j] = vr + gr * ur + gi * ui, vi + gi * ur - gr * ui
    ar[k], ai[k] = gr, gi


@njit(forceinline=True, error_model="numpy")
def reflect(k: int, re: Any, im: Any, ar: Any, ai: Any, inverse: Any) -> Any:
    """Return g_k = -(b_k + sum_j a_j b_{k-j}) / E_{k-1} (Levinson; Theorem 1).

    ``inverse`` is 1 / E_{k-1}.
    """
    x, y = re[k], im[k]
    for j in range(1, k):  # b_k + sum_{0<j<k} a_j b_{k-j}
        x = x + ar[j] * re[k - j] - ai[j] * im[k - j]
        y = y + ar[j] * im[k - j] + ai[j] * re[k - j]
    return -x * inverse, -y * inverse


@njit(forceinline=True, error_model="numpy")
def below_one(x: Any, y: Any) -> Any:
    """Return 1 - |g|^2 with an error relative to itself, also where |g| is close to 1.

    What rounding takes from the squares is put back; otherwise the errors and the polynomials of
    the recursion don't belong to each other.
    """
    xx, yy = x * x, y * y
    lost = simd.fma(x, x, -xx) + simd.fma(y, y, -yy)
    return ((1.0 - simd.maximum(xx, yy)) - simd.minimum(xx, yy)) - lost


@njit(forceinline=True, error_model="numpy")
def levinson(order: Any, re: Any, im: Any, ar: Any, ai: Any, gr: Any, gi: Any) -> Any:
    """Fill a_1 .. a_m and g_1 .. g_m from moments with b_0 = 1, and return E_m.

    Levinson's and Durbin's steps, which end with E_m B^-1 e_0 = a (Theorem 1). Where E_k would fall
    to 4 eps or below, the border of the cone, g_k is projected into the disc and all later ones are
    zero.
    """
    error = re[0]  # E_0 = b_0
    floor = 4.0 * simd.eps(error)
    alive = error > 0.0
    for k in range(1, len(order) + 1):
        x, y = reflect(k, re, im, ar, ai, 1.0 / error)
        remaining = error * below_one(x, y)  # E_k = E_{k-1} (1 - |g_k|^2)
        inside = remaining > floor
        if simd.some(~inside | ~alive):
            onto = simd.sqrt(simd.maximum(1.0 - floor / error, 0.0)) / simd.sqrt(x * x + y * y)
            onto = simd.select(inside, 1.0, onto)
            # NaN belongs to an invalid pixel, which keeps it
            x = simd.select(alive, x * onto, 0.0 * re[k])
            y = simd.select(alive, y * onto, 0.0 * im[k])
            remaining = simd.select(inside, remaining, error * below_one(x, y))
            remaining = simd.select(alive, remaining, error)
            alive = alive & inside
        step_up(k, ar, ai, x, y)
        gr[k - 1], gi[k - 1] = x, y
        error = remaining
    return error


@njit(forceinline=True, error_model="numpy")
def _nearer(n: int, d: Any, squares: Any, bound: Any) -> Any:
    """Return a lower bound of a tridiagonal matrix's eigenvalues, up to 64 times nearer to 0.

    A number is below all eigenvalues where all leading minors of T - x I are positive (Sturm). The
    smallest eigenvalue of few returns is next to 0, far from Gershgorin's negative bound: two
    trials take less than the steps of the iteration that they save. A positive bound stays.
    """
    for _ in range(2):
        tried = 0.125 * bound
        minor, before = d[0] - tried, bound * 0.0 + 1.0
        below = (tried > bound) & (minor > 0.0)
        for k in range(1, n):
            minor, before = (d[k] - tried) * minor - squares[k - 1] * before, minor
            below = below & (minor > 0.0)
        bound = simd.select(below, tried, bound)
    return bound


@njit(forceinline=True, error_model="numpy")
def smallest_eigenvalue(order: Any, re: Any, im: Any, h: Any, d: Any, e: Any) -> Any:
    """Return the smallest eigenvalue of B; ``h`` has room for a matrix, ``d`` and ``e`` for a row.

    B is unitarily similar to the real symmetric matrix Re b_{j-k} - Im b_{j+k-m} (transform by
    (I + i J) / sqrt 2). Householder reflections make it tridiagonal, and Laguerre's iteration
    climbs from Gershgorin's bound to the smallest root of its characteristic polynomial, which it
    never passes because all roots are real.
    """
    m = len(order)
    n = m + 1
    for i in range(n):
        for j in range(i + 1):
            k = i + j - m
            h[i * n + j] = re[i - j] - im[k] if k >= 0 else re[i - j] + im[-k]
    for i in range(n - 2):
        norm2 = h[(i + 1) * n + i] * h[(i + 1) * n + i]
        for j in range(i + 2, n):
            norm2 = norm2 + h[j * n + i] * h[j * n + i]
        norm = simd.sqrt(norm2)
        first = h[(i + 1) * n + i]
        half = norm2 + simd.absolute(first) * norm  # v'v / 2
        h[(i + 1) * n + i] = simd.select(first < 0.0, first - norm, first + norm)
        inverse = simd.select(half > simd.small(half), 1.0 / half, 0.0)
        inner = re[0] * 0.0
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
    e[n - 2] = simd.absolute(h[(n - 1) * n + n - 2])
    x = d[0] - e[0]
    for i in range(1, n - 1):
        x = simd.minimum(x, d[i] - e[i] - e[i - 1])
    x = simd.minimum(x, d[n - 1] - e[n - 2])
    for i in range(n - 1):
        e[i] = e[i] * e[i]
    x = _nearer(n, d, e, x)
    tolerance = 2.0 * simd.eps(x)
    last = x * 0.0
    moving = x == x
    for _ in range(_EIGENVALUE_STEPS):
        # p = det(T - x I) and its first two derivatives by the recurrence over leading blocks
        p0, q0, r0 = x * 0.0 + 1.0, x * 0.0, x * 0.0
        p1, q1, r1 = d[0] - x, q0 - 1.0, r0
        for k in range(1, n):
            t = d[k] - x
            p2 = t * p1 - e[k - 1] * p0
            q2 = t * q1 - p1 - e[k - 1] * q0
            r2 = t * r1 - 2.0 * q1 - e[k - 1] * r0
            p0, q0, r0, p1, q1, r1 = p1, q1, r1, p2, q2, r2
        inverse = 1.0 / p1
        g = q1 * inverse
        root = (n - 1.0) * ((n - 1.0) * g * g - n * r1 * inverse)
        climb = n / (simd.sqrt(simd.maximum(root, x * 0.0)) - g)
        left, past = (p1 > 0.0) & (q1 < 0.0), (p1 < 0.0) & (q1 < 0.0)
        step = simd.select(left, climb, 0.0)
        if simd.some(past):  # rounding may carry the last step past the root: Newton's comes back
            step = simd.select(past, simd.maximum(-1.0 / g, -0.25 * last), step)
        # a pixel that has arrived stays, however long its neighbours take
        x = simd.select(moving, x + step, x)
        last = simd.absolute(step)
        moving = moving & (last > tolerance)
        if not simd.some(moving):
            break
    return x
