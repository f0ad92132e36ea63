"""OpenSim's functions of one variable, read from a model file.

They say how a joint moves with its coordinate (the knee's sliding, for instance), and how one
coordinate follows another. Each is what OpenSim 4.6 computes, to rounding; the tests compare.
"""

from collections.abc import Callable, Mapping
from typing import Final
from xml.etree.ElementTree import Element

import numpy as np
from scipy.interpolate import PPoly
from scipy.linalg import solve_banded

from gaitval.arrays import Array
from gaitval.errors import ModelError
from gaitval.scaling.opensim.fields import number, numbers

CoordinateFunction = Callable[[Array], Array]
"""Values (T,) at values (T,) of the variable."""


def constant(value: float) -> CoordinateFunction:
    """The function that is `value` everywhere."""
    return lambda x: np.full(np.shape(x), value)


def read_function(element: Element, where: str) -> CoordinateFunction:
    """The function of an `element` such as `<SimmSpline>`. Raises ModelError, which says `where`,
    if it is not known, or its numbers are missing or cannot be used.
    """
    reader = _READERS.get(element.tag)
    if reader is None:
        raise ModelError(
            f"{where}: the function {element.tag} is not understood; those that are: "
            f"{', '.join(sorted(_READERS))}. Approximate it by a SimmSpline."
        )
    return reader(element, where)


def is_function(element: Element) -> bool:
    """Whether an element is one of the functions that are understood."""
    return element.tag in _READERS


def slope_and_offset(element: Element, where: str) -> tuple[float, float] | None:
    """Slope and offset of `element` if it is a `<LinearFunction>`; None for any other function.
    Raises ModelError, which says `where`, if it has not two coefficients.
    """
    if element.tag != "LinearFunction":
        return None
    found = numbers(element, "coefficients", where, default=(1.0, 0.0))
    if len(found) != 2:
        raise ModelError(f"{where}: a LinearFunction has two coefficients, not {len(found)}.")
    return float(found[0]), float(found[1])


def _linear(element: Element, where: str) -> CoordinateFunction:
    found = slope_and_offset(element, where)
    assert found is not None
    slope, offset = found
    return lambda x: slope * x + offset


def _constant(element: Element, where: str) -> CoordinateFunction:
    return constant(number(element, "value", where, default=0.0))


def _polynomial(element: Element, where: str) -> CoordinateFunction:
    # The highest power comes first.
    coefficients = numbers(element, "coefficients", where)
    if len(coefficients) == 0:
        raise ModelError(f"{where}: a PolynomialFunction without coefficients.")
    return lambda x: np.asarray(np.polyval(coefficients, x), dtype=float)


def _multiplier(element: Element, where: str) -> CoordinateFunction:
    """A function times a number: how OpenSim scales a joint."""
    scale = number(element, "scale", where, default=1.0)
    inner = [part for child in element for part in (child, *child) if is_function(part)]
    if not inner:
        raise ModelError(f"{where}: a MultiplierFunction without a function that is understood.")
    function = read_function(inner[0], where)
    return lambda x: scale * function(x)


def _points(element: Element, where: str, fewest: int) -> tuple[Array, Array]:
    x, y = (numbers(element, tag, where) for tag in "xy")
    if len(x) != len(y) or len(x) < fewest:
        raise ModelError(
            f"{where}: a {element.tag} needs at least {fewest} points with x and y, but it has "
            f"{len(x)} x and {len(y)} y."
        )
    if not (np.diff(x) > 0).all():
        raise ModelError(f"{where}: the x of a {element.tag} do not increase. Sort the points.")
    return x, y


def _piecewise_linear(element: Element, where: str) -> CoordinateFunction:
    x, y = _points(element, where, 2)
    slopes = np.diff(y) / np.diff(x)

    def value(at: Array) -> Array:
        inside = np.interp(at, x, y)
        # Straight on beyond the ends.
        return np.asarray(
            inside
            + slopes[0] * np.minimum(at - x[0], 0.0)
            + slopes[-1] * np.maximum(at - x[-1], 0.0)
        )

    return value


def _simm_spline(element: Element, where: str) -> CoordinateFunction:
    """SIMM's cubic spline, with the end conditions of Forsythe, Malcolm and Moler (1977, Computer
    Methods for Mathematical Computations, section 4.4): at either end the third derivative is that
    of the cubic through the four nearest points. Straight on beyond the ends.
    """
    x, y = _points(element, where, 2)
    # The unknowns `bend` are a sixth of the second derivatives at the points.
    step, slope = np.diff(x), np.diff(y) / np.diff(x)
    n = len(x)
    if n == 2:
        return lambda at: y[0] + slope[0] * (at - x[0])
    diagonal = np.concatenate(([-step[0]], 2.0 * (step[:-1] + step[1:]), [-step[-1]]))
    right = np.concatenate(([0.0], np.diff(slope), [0.0]))
    if n > 3:
        second = np.diff(slope) / (x[2:] - x[:-2])
        third = np.diff(second) / (x[3:] - x[:-3])
        right[0] = third[0] * step[0] ** 2
        right[-1] = -third[-1] * step[-1] ** 2
    bands = np.zeros((3, n))
    bands[0, 1:] = bands[2, :-1] = step
    bands[1] = diagonal
    bend = solve_banded((1, 1), bands, right)
    # Slope at the left end of each piece, from the values and second derivatives at both ends.
    begin = slope - step * (bend[1:] + 2.0 * bend[:-1])
    last = slope[-1] + step[-1] * (bend[-2] + 2.0 * bend[-1])
    cubic = PPoly(np.stack([np.diff(bend) / step, 3.0 * bend[:-1], begin, y[:-1]]), x)
    return _straight_beyond(cubic, x, y, (float(begin[0]), float(last)))


def _straight_beyond(
    spline: CoordinateFunction, x: Array, y: Array, slopes: tuple[float, float]
) -> CoordinateFunction:
    def value(at: Array) -> Array:
        inside = spline(np.clip(at, x[0], x[-1]))
        before = np.where(at < x[0], y[0] + slopes[0] * (at - x[0]), inside)
        return np.where(at > x[-1], y[-1] + slopes[1] * (at - x[-1]), before)

    return value


_READERS: Final[Mapping[str, Callable[[Element, str], CoordinateFunction]]] = {
    "Constant": _constant,
    "LinearFunction": _linear,
    "PolynomialFunction": _polynomial,
    "MultiplierFunction": _multiplier,
    "PiecewiseLinearFunction": _piecewise_linear,
    "SimmSpline": _simm_spline,
    # Older names of the same spline; it never was a natural one.
    "NaturalCubicSpline": _simm_spline,
    "natCubicSpline": _simm_spline,
}
