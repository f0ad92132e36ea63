"""Eight numbers that are computed with as one, for numba: a processor's vector of doubles.

`LANES` is a type for numba's compiler whose values are LLVM's `<8 x double>`: every sum, product,
root and comparison is one vector instruction (two or four on processors with shorter vectors), and
nothing depends on whether a compiler recognises a loop. Arrays of it are made from arrays (…, 8) of
doubles by `in_lanes`; their elements are indexed like any others. A function that branches with
`where` and calls the functions of this module, in the place of those of `math`, compiles for
doubles and for lanes, and every lane has, bit for bit, the result that doubles have: both do the
same operations in the same order, and each of them is rounded as IEEE 754 says.

Sine, cosine and exponential are polynomials of this module: a library's are scalar, and differ from
machine to machine.
"""

import math
import operator
from typing import Any, ClassVar

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typeconv import Conversion
from numba.core.typing import signature
from numba.core.typing.templates import ConcreteTemplate, infer_global
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model
from numba.np.arrayobj import make_array, populate_array

from gaitval.compiled import njit_borrowing

WIDTH = 8


def _instructions(function: Any) -> Any:
    """numba's `intrinsic`: the function returns its signature, and what writes LLVM's code."""
    return intrinsic(function)


class _Lanes(types.Type):
    def __init__(self) -> None:
        super().__init__(name=f"Lanes{WIDTH}")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        if isinstance(other, types.Float):
            return Conversion.safe
        return None

    def unify(self, typingctx: Any, other: Any) -> Any:
        return self if isinstance(other, types.Float) else None


class _Mask(types.Type):
    def __init__(self) -> None:
        super().__init__(name=f"Mask{WIDTH}")


LANES, MASK = _Lanes(), _Mask()
_DOUBLE = ir.DoubleType()
_VECTOR = ir.VectorType(_DOUBLE, WIDTH)
_BITS = ir.IntType(64)


@register_model(_Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


@register_model(_Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, ir.VectorType(ir.IntType(1), WIDTH))


def _spread(builder: Any, value: Any, count: int = WIDTH) -> Any:
    """A vector with `value` in every lane."""
    kind = ir.VectorType(value.type, count)
    first = builder.insert_element(ir.Constant(kind, ir.Undefined), value, ir.IntType(32)(0))
    order = ir.Constant(ir.VectorType(ir.IntType(32), count), [0] * count)
    return builder.shuffle_vector(first, ir.Constant(kind, ir.Undefined), order)


@lower_cast(types.Float, _Lanes)
def _number_in_lanes(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    return _spread(builder, context.cast(builder, value, fromty, types.float64))


def _operator(symbols: tuple[Any, ...], result: Any, instruction: Any) -> None:
    """Type and lower a binary operator of two vectors."""
    for symbol in symbols:
        template = type(
            "LanesOperator", (ConcreteTemplate,), {"cases": [signature(result, LANES, LANES)]}
        )
        infer_global(symbol)(template)

        @lower_builtin(symbol, LANES, LANES)
        def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return instruction(builder, *args)


_operator((operator.add, operator.iadd), LANES, lambda b, x, y: b.fadd(x, y))
_operator((operator.sub, operator.isub), LANES, lambda b, x, y: b.fsub(x, y))
_operator((operator.mul, operator.imul), LANES, lambda b, x, y: b.fmul(x, y))
_operator((operator.truediv, operator.itruediv), LANES, lambda b, x, y: b.fdiv(x, y))
_operator((operator.lt,), MASK, lambda b, x, y: b.fcmp_ordered("<", x, y))
_operator((operator.le,), MASK, lambda b, x, y: b.fcmp_ordered("<=", x, y))
_operator((operator.gt,), MASK, lambda b, x, y: b.fcmp_ordered(">", x, y))
_operator((operator.ge,), MASK, lambda b, x, y: b.fcmp_ordered(">=", x, y))
_operator((operator.eq,), MASK, lambda b, x, y: b.fcmp_ordered("==", x, y))
_operator((operator.ne,), MASK, lambda b, x, y: b.fcmp_unordered("!=", x, y))


@infer_global(operator.neg)
class _Negative(ConcreteTemplate):
    cases: ClassVar[list[Any]] = [signature(LANES, LANES)]


@lower_builtin(operator.neg, LANES)
def _negative(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fneg(args[0])


def _of_one(name: str) -> Any:
    """A function of one number or vector that LLVM has an instruction for."""

    def typed(typingctx: Any, x: Any) -> Any:
        kind = LANES if isinstance(x, _Lanes) else types.float64

        def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            vector = _VECTOR if kind is LANES else _DOUBLE
            function = cgutils.get_or_insert_function(
                builder.module,
                ir.FunctionType(vector, [vector]),
                f"llvm.{name}." + ("v8f64" if kind is LANES else "f64"),
            )
            return builder.call(function, args)

        return signature(kind, kind), lower

    return _instructions(typed)


sqrt = _of_one("sqrt")
floor = _of_one("floor")
nearest = _of_one("nearbyint")
magnitude = _of_one("fabs")


@_instructions
def where(typingctx: Any, condition: Any, yes: Any, no: Any) -> Any:
    """`yes` where the condition holds, else `no`; both are computed."""
    kind = LANES if isinstance(condition, _Mask) else types.float64

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.select(*args)

    return signature(kind, condition, kind, kind), lower


@_instructions
def everywhere(typingctx: Any, condition: Any) -> Any:
    """Whether the condition holds in every lane."""

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if not isinstance(condition, _Mask):
            return args[0]
        bits = ir.IntType(WIDTH)
        return builder.icmp_signed("==", builder.bitcast(args[0], bits), bits(-1))

    return signature(types.boolean, condition), lower


@_instructions
def power_of_two(typingctx: Any, x: Any) -> Any:
    """2ˣ of a whole number between -1022 and 1023."""
    kind = LANES if isinstance(x, _Lanes) else types.float64

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        (value,) = args
        bits = ir.VectorType(_BITS, WIDTH) if kind is LANES else _BITS
        magic, shift = _DOUBLE(float(2**52 + 2**51 + 1023)), _BITS(52)
        if kind is LANES:
            magic, shift = _spread(builder, magic), _spread(builder, shift)
        # The low bits of the sum are those of the whole number plus the exponent's bias.
        whole = builder.bitcast(builder.fadd(value, magic), bits)
        return builder.bitcast(builder.shl(whole, shift), value.type)

    return signature(kind, kind), lower


@_instructions
def width(typingctx: Any, x: Any) -> Any:
    """How many numbers there are in one."""
    count = WIDTH if isinstance(x, _Lanes) else 1

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return context.get_constant(types.intp, count)

    return signature(types.intp, x), lower


@_instructions
def lane(typingctx: Any, x: Any, i: Any) -> Any:
    """The number in lane i."""

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.extract_element(*args) if isinstance(x, _Lanes) else args[0]

    return signature(types.float64, x, types.intp), lower


@_instructions
def with_lane(typingctx: Any, x: Any, i: Any, number: Any) -> Any:
    """The same numbers but for the one in lane i."""

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        vector, place, value = args
        return builder.insert_element(vector, value, place) if isinstance(x, _Lanes) else value

    return signature(x, x, types.intp, types.float64), lower


def _view(context: Any, builder: Any, kinds: Any, array: Any, extent: Any) -> Any:
    """A view of an array's memory; `kinds` are the array's type and the view's, and `extent` of
    (shape, strides) gives its own shape, strides and bytes of an item.
    """
    kind, result = kinds
    source, out = make_array(kind)(context, builder, array), make_array(result)(context, builder)
    shape = cgutils.unpack_tuple(builder, source.shape)
    shape, strides, size = extent(shape, cgutils.unpack_tuple(builder, source.strides))
    populate_array(
        out,
        data=builder.bitcast(source.data, out.data.type),
        shape=shape,
        strides=strides,
        itemsize=context.get_constant(types.intp, size),
        meminfo=source.meminfo,
        parent=source.parent,
    )
    if context.enable_nrt:
        context.nrt.incref(builder, result, out._getvalue())
    return out._getvalue()


def _lanes_type(kind: Any) -> Any:
    if isinstance(kind, types.NamedTuple):
        members = [_lanes_type(member) for member in kind.types]
        if all(member == members[0] for member in members):
            return types.NamedUniTuple(members[0], len(members), kind.instance_class)
        return types.NamedTuple(members, kind.instance_class)
    if isinstance(kind, types.NamedUniTuple):
        return types.NamedUniTuple(_lanes_type(kind.dtype), kind.count, kind.instance_class)
    if isinstance(kind, types.Array) and kind.dtype == types.float64:
        return types.Array(LANES, kind.ndim - 1, "C", aligned=False)
    return kind


def _to_lanes(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    result = _lanes_type(kind)
    if isinstance(kind, types.NamedTuple | types.NamedUniTuple):
        members = cgutils.unpack_tuple(builder, value)
        converted = [_to_lanes(context, builder, *pair) for pair in zip(kind, members, strict=True)]
        return context.make_tuple(builder, result, converted)
    if result == kind:
        return value
    return _view(context, builder, (kind, result), value, lambda a, b: (a[:-1], b[:-1], 8 * WIDTH))


@_instructions
def in_lanes(typingctx: Any, arrays: Any) -> Any:
    """An array (…, 8) of doubles as an array of lanes, without a copy; of a named tuple, all its
    arrays of doubles.
    """

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _to_lanes(context, builder, arrays, args[0])

    return signature(_lanes_type(arrays), arrays), lower


@_instructions
def in_numbers(typingctx: Any, array: Any) -> Any:
    """An array of lanes as an array (…, 8) of doubles, without a copy."""
    result = types.Array(types.float64, array.ndim + 1, "C")

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lanes, size = (context.get_constant(types.intp, n) for n in (WIDTH, 8))
        return _view(
            context, builder, (array, result), args[0],
            lambda shape, strides: ([*shape, lanes], [*strides, size], 8),
        )  # fmt: skip

    return signature(result, array), lower


def with_lanes(arrays: Any) -> Any:
    """Named tuples of arrays of doubles with a last axis of eight, all zero, for `in_lanes`;
    integers stay.
    """
    if isinstance(arrays, tuple):
        return type(arrays)(*(with_lanes(member) for member in arrays))
    return np.zeros((*arrays.shape, WIDTH)) if arrays.dtype == float else arrays


# Cody and Waite's three parts of π/2, and the polynomials of fdlibm's sine and cosine (Sun
# Microsystems 1993) on -π/4 ... π/4: errors below one unit in the last place.
_PI_1, _PI_2, _PI_3 = (
    1.57079632673412561417e00,
    6.07710050630396597660e-11,
    2.02226624879595063154e-21,
)


@njit_borrowing
def sine_cosine(x: Any) -> Any:
    """Sine and cosine of an angle (rad) of up to 1e5 or so."""
    turns = nearest(x * 0.63661977236758138)
    y = ((x - turns * _PI_1) - turns * _PI_2) - turns * _PI_3
    z = y * y
    s = y + y * z * (
        -1.66666666666666324348e-01
        + z
        * (
            8.33333333332248946124e-03
            + z
            * (
                -1.98412698298579493134e-04
                + z
                * (
                    2.75573137070700676789e-06
                    + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)
                )
            )
        )
    )
    c = 1.0 - (
        0.5 * z
        - z
        * z
        * (
            4.16666666666666019037e-02
            + z
            * (
                -1.38888888888741095749e-03
                + z
                * (
                    2.48015872894767294178e-05
                    + z
                    * (
                        -2.75573143513906633035e-07
                        + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)
                    )
                )
            )
        )
    )
    half = 0.5 * turns
    odd = half != floor(half)
    quarter = 0.5 * floor(half)
    sine, cosine = where(odd, c, s), where(odd, -s, c)
    back = quarter != floor(quarter)
    return where(back, -sine, sine), where(back, -cosine, cosine)


@njit_borrowing
def exponential(x: Any) -> Any:
    """eˣ; beyond -700 ... 700 that of the bound."""
    x = where(x < -700.0, -700.0, x)
    x = where(x > 700.0, 700.0, x)
    n = nearest(x * 1.44269504088896338700)
    r = (x - n * 6.93147180369123816490e-01) - n * 1.90821492927058770002e-10
    # Taylor's polynomial of degree 13 on ±½ ln 2: truncated at 4e-18.
    p = 1.0 + r * (
        1.0
        + r
        * (
            1 / 2
            + r
            * (
                1 / 6
                + r
                * (
                    1 / 24
                    + r
                    * (
                        1 / 120
                        + r
                        * (
                            1 / 720
                            + r
                            * (
                                1 / 5040
                                + r
                                * (
                                    1 / 40320
                                    + r
                                    * (
                                        1 / 362880
                                        + r
                                        * (
                                            1 / 3628800
                                            + r
                                            * (
                                                1 / 39916800
                                                + r * (1 / 479001600 + r * (1 / 6227020800))
                                            )
                                        )
                                    )
                                )
                            )
                        )
                    )
                )
            )
        )
    )
    return p * power_of_two(n)


@njit_borrowing
def arctangent(y: Any, x: Any) -> Any:
    """Angle (rad) of the point (x, y) from the x axis; a library's, lane by lane."""
    angle = y
    for i in range(width(y)):
        angle = with_lane(angle, i, math.atan2(lane(y, i), lane(x, i)))
    return angle
