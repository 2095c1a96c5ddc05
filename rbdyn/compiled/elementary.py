"""exp, ln and two roots for kernels: inlined and branch-free, several times as fast as calls of the C library.

Range reduction by the bits of the double and a polynomial short enough to stay in registers. Relative error below
4e-16 for finite normal arguments, which is all that kernels pass; NaN comes through. Used compiled or interpreted
with equal results to that error.
"""

import math
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from rbdyn.compiled.kernel import INLINED, kernel

LN2_HIGH, LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
LOG2_E = 1.4426950408889634
ROUND = 6755399441055744.0  # 1.5 * 2^52: adding it leaves the rounded integer in the low bits
SQRT_HALF_BITS = 0x3FE6A09E667F3BCD
BIAS = 1023
EXPONENT_MASK = -(1 << 52)
TWO_52, TWO_52_BITS = (4503599627370496.0, 0x4330000000000000)  # an integer below 2^52 in its low bits reads as a float


def compiled_as(interpreted: Callable[..., Any]) -> Callable[[Callable[..., Any]], None]:
    """Give a function a body of its own where it is compiled."""

    def register(body: Callable[..., Any]) -> None:
        choose: Any = overload
        choose(interpreted, jit_options=INLINED, strict=False)(lambda *arguments: body)

    return register


@intrinsic
def _bits(typing_context: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], ir.IntType(64))

    return types.int64(types.float64), generate


@intrinsic
def _from_bits(typing_context: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], ir.DoubleType())

    return types.float64(types.int64), generate


@intrinsic
def _fused(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


def fma(a: float, b: float, c: float) -> float:
    """a b + c, rounded once where compiled: asked for by name, it is the same in scalar and in vector code."""
    return a * b + c


@compiled_as(fma)
def _(a, b, c):
    return _fused(a, b, c)


def fast_exp(x: float) -> float:
    """e^x for -700 <= x <= 700 (clamped below)."""
    return math.exp(max(x, -700.0))


@compiled_as(fast_exp)
def _(x):
    r, scale = _reduced(x)
    return _exponential_series(r, 1.0 + r) * scale


def fast_expm1(x: float) -> float:
    """e^x - 1 for 0 <= x <= 700, to a few 1e-16 of itself however small x is."""
    return math.expm1(x)


@compiled_as(fast_expm1)
def _(x):
    r, scale = _reduced(x)
    return fma(_exponential_series(r, r), scale, scale - 1.0)


def fast_tanh(x: float) -> float:
    """Hyperbolic tangent, to a few 1e-16 of itself."""
    return math.tanh(x)


@compiled_as(fast_tanh)
def _(x):
    # By e^2x - 1, which keeps its figures near zero; from 20 on it is one.
    doubled = 2.0 * abs(x)
    doubled = 40.0 if doubled > 40.0 else doubled
    grown = fast_expm1(doubled)
    return math.copysign(grown / (grown + 2.0), x)


@kernel
def _reduced(x):
    """Rest r of x after whole halvings of e^x, |r| < 0.35, and the power of two that they make."""
    x = -700.0 if x < -700.0 else x
    shifted = fma(x, LOG2_E, ROUND)
    nearest = shifted - ROUND
    r = fma(-nearest, LN2_LOW, fma(-nearest, LN2_HIGH, x))
    return r, _from_bits((_bits(shifted) + BIAS) << 52)


@kernel
def _exponential_series(r, head):
    """Series of e^r from its second power on, with ``head`` for what stands before: 1 + r, or r for e^r - 1."""
    r2 = r * r
    r4 = r2 * r2
    r8 = r4 * r4
    # Taylor to r^13 (|r| < 0.35), in Estrin's order: four short chains instead of a long one.
    first = fma(r2, fma(r, 1.0 / 6.0, 0.5), head)
    second = fma(r2, fma(r, 1.0 / 5040.0, 1.0 / 720.0), fma(r, 1.0 / 120.0, 1.0 / 24.0))
    third = fma(r2, fma(r, 1.0 / 39916800.0, 1.0 / 3628800.0), fma(r, 1.0 / 362880.0, 1.0 / 40320.0))
    high = fma(r4, fma(r, 1.0 / 6227020800.0, 1.0 / 479001600.0), third)
    low = fma(r4, second, first)
    return fma(r8, high, low)


@kernel
def _split(x):
    """Power of two and mantissa less one of a positive normal number, the mantissa in [sqrt(1/2), sqrt(2))."""
    # Only operations that vectorise.
    offset = _bits(x) - SQRT_HALF_BITS
    power = _from_bits(((offset + (BIAS << 52)) >> 52) | TWO_52_BITS) - (TWO_52 + BIAS)
    return power, _from_bits(_bits(x) - (offset & EXPONENT_MASK)) - 1.0


def fast_log(x: float) -> float:
    """Natural logarithm of a positive normal number."""
    return math.log(x)


@compiled_as(fast_log)
def _(x):
    power, f = _split(x)
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    # ln((1 + s)/(1 - s)) = 2 s (1 + z/3 + z^2/5 + ...), minimax coefficients of fdlibm.
    even = w * fma(w, fma(w, 1.531383769920937332e-01, 2.222219843214978396e-01), 3.999999999940941908e-01)
    odd = fma(w, fma(w, 1.479819860511658591e-01, 1.818357216161805012e-01), 2.857142874366239149e-01)
    odd = fma(w, odd, 6.666666666666735130e-01)
    half_square = 0.5 * f * f
    series = s * (half_square + fma(z, odd, even))
    # x - x is zero, or NaN where x is: the bits alone would hide it.
    low = half_square - fma(power, LN2_LOW, series)
    return fma(power, LN2_HIGH, f - low) + (x - x)


def rough_power(x: float, exponent: float) -> float:
    """x^exponent of a positive normal number to a few parts in 1e4 times the exponent, to start from."""
    return float(x**exponent)


@compiled_as(rough_power)
def _(x, exponent):
    power, f = _split(x)
    # Minimax: log2(1 + f) within 6.4e-4 over a factor of two, then 2^t within 2.6e-6 over [-1/2, 1/2].
    high = fma(f, fma(f, 4.47594888e-1, -7.60965453e-1), 1.44564380)
    log_2 = power + fma(f, high, 5.83271110e-4)
    shifted = fma(log_2, exponent, ROUND)
    t = fma(log_2, exponent, ROUND - shifted)
    t2 = t * t
    low = fma(t, 0.69312181, 0.99999926)
    high = fma(t2, 0.0095701, fma(t, 0.05591786, 0.24024745))
    return fma(t2, high, low) * _from_bits((_bits(shifted) + BIAS) << 52)


@kernel
def _fourth_power(x):
    square = x * x
    return square * square


@kernel
def _root_from(x, guess, half, n):
    """x^(1/n) from an estimate g of x^(-1/n) and ``half`` = g^(n/2 - 1).

    With s = x g^(n-1) it is s (s g)^(-(n-1)/n) exactly; four terms of the binomial series in 1 - s g < 6e-4 leave 1e-17,
    and the rounding errors of s are cut by n.
    """
    s = x * half * half * guess
    share = (n - 1) / n
    r = fma(-s, guess, 1.0)
    inner = fma((share + 1.0) / 2.0 * r, fma((share + 2.0) / 3.0 * r, fma((share + 3.0) / 4.0, r, 1.0), 1.0), 1.0)
    return s * fma(share * r, inner, 1.0)


def tenth_root(x: float) -> float:
    """x^(1/10) of a positive normal number."""
    return float(x ** (1.0 / 10.0))


@compiled_as(tenth_root)
def _(x):
    guess = rough_power(x, -1.0 / 10.0)
    return _root_from(x, guess, _fourth_power(guess), 10)


def eighteenth_root(x: float) -> float:
    """x^(1/18) of a positive normal number."""
    return float(x ** (1.0 / 18.0))


@compiled_as(eighteenth_root)
def _(x):
    guess = rough_power(x, -1.0 / 18.0)
    return _root_from(x, guess, _fourth_power(guess * guess), 18)


PIO2_1, PIO2_2, PIO2_3 = 1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21
TWO_OVER_PI = 0.63661977236758134308


def fast_cos_sin(x: float) -> tuple[float, float]:
    """Cosine and sine of an angle [rad] below 1e6 turns, to 2e-16 of one."""
    return math.cos(x), math.sin(x)


@compiled_as(fast_cos_sin)
def _(x):
    # Quarter turns are taken off in three parts; their last two bits choose function and sign.
    shifted = fma(x, TWO_OVER_PI, ROUND)
    nearest = shifted - ROUND
    r = fma(-nearest, PIO2_3, fma(-nearest, PIO2_2, fma(-nearest, PIO2_1, x)))
    z = r * r
    # Minimax coefficients of fdlibm for |r| < pi/4.
    high = fma(z, fma(z, 1.58969099521155010221e-10, -2.50507602534068634195e-08), 2.75573137070700676789e-06)
    low = fma(z, fma(z, high, -1.98412698298579493134e-04), 8.33333333332248946124e-03)
    sine = fma(r * z, fma(z, low, -1.66666666666666324348e-01), r)
    high = fma(z, fma(z, -1.13596475577881948265e-11, 2.08757232129817482790e-09), -2.75573143513906633035e-07)
    low = fma(z, fma(z, high, 2.48015872894767294178e-05), -1.38888888888741095749e-03)
    cosine = fma(z * z, fma(z, low, 4.16666666666666019037e-02), fma(z, -0.5, 1.0))
    quarter = _bits(shifted)
    odd = (quarter & 1) != 0
    first, second = (sine, cosine) if odd else (cosine, sine)
    first = -first if ((quarter + 1) & 2) != 0 else first
    second = -second if (quarter & 2) != 0 else second
    return first, second


def fast_atan(p: float, q: float) -> float:
    """atan(p/q) for q > 0."""
    return math.atan2(p, q)


@compiled_as(fast_atan)
def _(p, q):
    size = abs(p)
    steep = size > q
    low, high = (q, size) if steep else (size, q)
    # Beyond pi/8 the angle is measured from pi/4.
    far = low > 0.41421356237309503 * high
    x = (low - high) / (low + high) if far else low / high
    z = x * x
    w = z * z
    # Minimax coefficients of fdlibm for |x| < 7/16.
    even = fma(w, 1.62858201153657823623e-02, 4.97687799461593236017e-02)
    even = fma(w, fma(w, even, 6.66107313738753120669e-02), 9.09088713343650656196e-02)
    even = fma(w, fma(w, even, 1.42857142725034663711e-01), 3.33333333333329318027e-01)
    odd = fma(w, -3.65315727442169155270e-02, -5.83357013379057348645e-02)
    odd = fma(w, fma(w, odd, -7.69187620504482999495e-02), -1.11111104054623557880e-01)
    odd = fma(w, odd, -1.99999999998764832476e-01)
    angle = fma(-x, z * fma(z, odd, even), x)
    angle = angle + 0.78539816339744830962 if far else angle
    angle = 1.57079632679489661923 - angle if steep else angle
    return math.copysign(angle, p)
