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

How numba is extended here. A new type needs a class for type inference (`_Lanes`), a model that
maps it to a type of LLVM (`_LanesModel`), and for every operation a signature and a function that
writes LLVM's instructions ("lowering"). Operators are registered by symbol (`_operator`), functions
are `intrinsic`s: a Python function that runs at type inference and returns the signature and the
lowering. None of the code in a lowering runs when the program computes; it runs once, when numba
compiles. In numba's conventions `context` is the code generator for the processor, `builder` writes
LLVM's instructions, `sig` is the signature that was chosen and `args` are LLVM's values.

It is long because numba needs a signature and a lowering for every operation.
"""

import math
import operator
from typing import Any, ClassVar

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typeconv import Conversion
from numba.core.typing import signature
from numba.core.typing.templates import ConcreteTemplate, infer_global
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model
from numba.np.arrayobj import make_array, populate_array

from gaitval._internal.numba.compiled import njit_borrowing
from gaitval.arrays import aligned

# One AVX-512 register: 8 x 64 bits. LLVM splits the vector into two or four registers where they
# are shorter (AVX, or SSE2 and NEON), with the same rounding. `WIDTH` is part of the names of the
# types below, because numba compares types, and finds functions in its cache, by name.
WIDTH = 8


_instructions: Any = intrinsic
"""Of a function that returns its signature, and what writes LLVM's code."""


class _Lanes(types.Type):
    """Eight doubles, for type inference."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes{WIDTH}")

    # Lets a plain number stand where lanes are expected, as in `0.5 * x`: numba then casts it with
    # `_number_in_lanes`. "Safe", not "exact", so that two plain numbers are still multiplied as
    # numbers.
    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        if isinstance(other, types.Float):
            return Conversion.safe
        return None

    # A variable that is a number on one path and lanes on another, such as a sum that starts at
    # 0.0, is lanes on both.
    def unify(self, typingctx: Any, other: Any) -> Any:
        return self if isinstance(other, types.Float) else None


class _Mask(types.Type):
    """What a comparison of lanes gives: a truth value per lane, for `where` and `everywhere`."""

    def __init__(self) -> None:
        super().__init__(name=f"Mask{WIDTH}")


LANES, MASK = _Lanes(), _Mask()
_DOUBLE = ir.DoubleType()
_VECTOR = ir.VectorType(_DOUBLE, WIDTH)
_BITS = ir.IntType(64)


# A primitive model: in variables, in arrays and as an argument a value has the same LLVM type,
# without a Python object around it.
@register_model(_Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


@register_model(_Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        # One bit per lane, as LLVM's `fcmp` gives and its `select` takes.
        super().__init__(manager, kind, ir.VectorType(ir.IntType(1), WIDTH))


def _spread(builder: Any, value: Any) -> Any:
    """A vector with `value` in every lane."""
    kind = ir.VectorType(value.type, WIDTH)
    # LLVM's idiom for a broadcast: put the number in lane 0 of an undefined vector, then take lane
    # 0 for every lane. Its optimiser turns the pair into one instruction.
    first = builder.insert_element(ir.Constant(kind, ir.Undefined), value, ir.IntType(32)(0))
    order = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, ir.Constant(kind, ir.Undefined), order)


@lower_cast(types.Float, _Lanes)
def _number_in_lanes(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    """The cast that `_Lanes.can_convert_from` promises; single precision is widened first."""
    return _spread(builder, context.cast(builder, value, fromty, types.float64))


def _operator(symbols: tuple[Any, ...], result: Any, instruction: Any) -> None:
    """Make numba know a binary operator of two vectors: its type `result`, `LANES` or `MASK`, and
    its LLVM `instruction`, (builder, x, y) to LLVM's value. `symbols` are those of Python's
    `operator`; `x += y` is one of its own.
    """
    for symbol in symbols:
        # A class for each symbol: numba stores what it has resolved in the template's class.
        template = type(
            "LanesOperator", (ConcreteTemplate,), {"cases": [signature(result, LANES, LANES)]}
        )
        infer_global(symbol)(template)

        @lower_builtin(symbol, LANES, LANES)
        def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return instruction(builder, *args)


# Without fast-math flags: with them LLVM may reorder sums and fuse a product with a sum, and lanes
# would no longer equal doubles bit for bit.
_operator((operator.add, operator.iadd), LANES, lambda b, x, y: b.fadd(x, y))
_operator((operator.sub, operator.isub), LANES, lambda b, x, y: b.fsub(x, y))
_operator((operator.mul, operator.imul), LANES, lambda b, x, y: b.fmul(x, y))
_operator((operator.truediv, operator.itruediv), LANES, lambda b, x, y: b.fdiv(x, y))
# "Ordered" is false where a number is NaN and "unordered" is true, as Python and IEEE 754 have it:
# NaN is not less than, equal to or greater than anything, but it differs from everything.
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


def _instruction(kind: Any, name: str, count: int) -> Any:
    """The lowering of a function of `count` numbers of a `kind` that LLVM has an instruction for,
    by the `name` of the intrinsic without its type, such as `sqrt` of `llvm.sqrt.v8f64`. Only those
    whose result IEEE 754 fixes are used: LLVM's sine may call a library, and would differ.
    """

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        # The declaration is per module of LLVM, and functions of both kinds may be in one module.
        vector = _VECTOR if kind is LANES else _DOUBLE
        function = cgutils.get_or_insert_function(
            builder.module,
            ir.FunctionType(vector, [vector] * count),
            f"llvm.{name}." + ("v8f64" if kind is LANES else "f64"),
        )
        return builder.call(function, args)

    return lower


def _of_one(name: str) -> Any:
    """LLVM's instruction `name` of one number or vector."""

    def typed(typingctx: Any, x: Any) -> Any:
        kind = LANES if isinstance(x, _Lanes) else types.float64
        return signature(kind, kind), _instruction(kind, name, 1)

    return _instructions(typed)


sqrt = _of_one("sqrt")
floor = _of_one("floor")
# The nearest whole number, as a double; halves are rounded to the even one.
nearest = _of_one("nearbyint")
magnitude = _of_one("fabs")


@_instructions
def fused(typingctx: Any, x: Any, y: Any, z: Any) -> Any:
    """x y + z, rounded once, of `x`, `y` and `z`, all doubles or all lanes; as fast as a product
    where the processor has the instruction. `typingctx`, here and below, is numba's; the caller
    does not pass it.
    """
    kind = LANES if isinstance(x, _Lanes) else types.float64
    return signature(kind, kind, kind, kind), _instruction(kind, "fma", 3)


@_instructions
def where(typingctx: Any, condition: Any, yes: Any, no: Any) -> Any:
    """`yes` where the `condition` holds, else `no`; both are computed, so neither may be too
    costly. They are numbers or lanes; numbers if the condition is a truth value, not one per lane.
    (`typingctx`: see `fused`.)
    """
    kind = LANES if isinstance(condition, _Mask) else types.float64

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        # The signature has made lanes of numbers among `yes` and `no`, so both have the condition's
        # width.
        return builder.select(*args)

    return signature(kind, condition, kind, kind), lower


@_instructions
def everywhere(typingctx: Any, condition: Any) -> Any:
    """Whether the `condition`, a truth value or one per lane, holds in every lane. (`typingctx`:
    see `fused`.)
    """

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if not isinstance(condition, _Mask):
            return args[0]
        # Eight bits read as one signed byte: all are set if it is -1.
        bits = ir.IntType(WIDTH)
        return builder.icmp_signed("==", builder.bitcast(args[0], bits), bits(-1))

    return signature(types.boolean, condition), lower


@_instructions
def power_of_two(typingctx: Any, x: Any) -> Any:
    """2ˣ, exactly; `x` is a whole number between -1022 and 1023, or lanes of them; others are not
    checked. (`typingctx`: see `fused`.)
    """
    kind = LANES if isinstance(x, _Lanes) else types.float64

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        (value,) = args
        bits = ir.VectorType(_BITS, WIDTH) if kind is LANES else _BITS
        # 2⁵² + 2⁵¹ brings any small whole number, also a negative one, between 2⁵² and 2⁵³, where
        # doubles are exactly the whole numbers: the number is then in the low bits of the mantissa.
        # 1023 is the bias of a double's exponent.
        magic, shift = _DOUBLE(float(2**52 + 2**51 + 1023)), _BITS(52)
        if kind is LANES:
            magic, shift = _spread(builder, magic), _spread(builder, shift)
        # So the low bits of the sum are x + 1023. Shifted by the 52 bits of the mantissa they are
        # the exponent of a double with mantissa 1; the sum's own exponent falls out at the top.
        whole = builder.bitcast(builder.fadd(value, magic), bits)
        return builder.bitcast(builder.shl(whole, shift), value.type)

    return signature(kind, kind), lower


@_instructions
def width(typingctx: Any, x: Any) -> Any:
    """How many numbers there are in `x`: 8 of lanes, 1 of a double. It is a constant of the
    compiler, so that a loop over lanes costs doubles nothing. (`typingctx`: see `fused`.)
    """
    count = WIDTH if isinstance(x, _Lanes) else 1

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return context.get_constant(types.intp, count)

    return signature(types.intp, x), lower


@_instructions
def lane(typingctx: Any, x: Any, i: Any) -> Any:
    """The number in lane `i` (0 to 7; not checked) of `x`; of a double, itself. (`typingctx`: see
    `fused`.)
    """

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.extract_element(*args) if isinstance(x, _Lanes) else args[0]

    return signature(types.float64, x, types.intp), lower


@_instructions
def with_lane(typingctx: Any, x: Any, i: Any, number: Any) -> Any:
    """`x` with the double `number` in lane `i` (0 to 7; not checked), and the other lanes
    unchanged; of a double, `number`. `x` is not changed, because values of LLVM never are.
    (`typingctx`: see `fused`.)
    """

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        vector, place, value = args
        return builder.insert_element(vector, value, place) if isinstance(x, _Lanes) else value

    return signature(x, x, types.intp, types.float64), lower


def _view(context: Any, builder: Any, kinds: Any, array: Any, extent: Any) -> Any:
    """A view of the memory of LLVM's `array` as an array of another type; `kinds` are numba's types
    of the array and of the view, `extent` gives of the array's (shape, strides) those of the view
    and the bytes of its items.
    """
    kind, result = kinds
    source, out = make_array(kind)(context, builder, array), make_array(result)(context, builder)
    shape = cgutils.unpack_tuple(builder, source.shape)
    shape, strides, size = extent(shape, cgutils.unpack_tuple(builder, source.strides))
    # `meminfo` is numba's owner of the memory and `parent` the NumPy array that it may come from.
    # The view has both, so the memory lives as long as the view does.
    populate_array(
        out,
        data=builder.bitcast(source.data, out.data.type),
        shape=shape,
        strides=strides,
        itemsize=context.get_constant(types.intp, size),
        meminfo=source.meminfo,
        parent=source.parent,
    )
    # numba takes the returned value for a new reference and drops one when it goes out of scope, so
    # one is added here. `njit_borrowing` compiles without reference counts, and needs none.
    if context.enable_nrt:
        context.nrt.incref(builder, result, out._getvalue())
    return out._getvalue()


def _lanes_type(kind: Any) -> Any:
    """The type that `in_lanes` gives for the type `kind`."""
    if isinstance(kind, types.NamedTuple):
        members = [_lanes_type(member) for member in kind.types]
        # numba types a named tuple whose members have one type as a `NamedUniTuple`. A `NamedTuple`
        # of equal members would be another type to it, and no function would accept it.
        if all(member == members[0] for member in members):
            return types.NamedUniTuple(members[0], len(members), kind.instance_class)
        return types.NamedTuple(members, kind.instance_class)
    if isinstance(kind, types.NamedUniTuple):
        return types.NamedUniTuple(_lanes_type(kind.dtype), kind.count, kind.instance_class)
    if isinstance(kind, types.Array) and kind.dtype == types.float64:
        # Not aligned: LLVM would load `<8 x double>` with an instruction that needs an address
        # divisible by 64, which NumPy's memory often is not, and the process would be killed. An
        # unaligned load of aligned memory costs nothing.
        return types.Array(LANES, kind.ndim - 1, "C", aligned=False)
    return kind


def _to_lanes(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """The value `value` of type `kind`, with its arrays of doubles as arrays of lanes."""
    result = _lanes_type(kind)
    if isinstance(kind, types.NamedTuple | types.NamedUniTuple):
        members = cgutils.unpack_tuple(builder, value)
        converted = [_to_lanes(context, builder, *pair) for pair in zip(kind, members, strict=True)]
        return context.make_tuple(builder, result, converted)
    if result == kind:
        return value
    # The last axis becomes the item: 8 x 8 bytes. Nothing here can see whether it is eight long and
    # contiguous; arrays that `with_lanes` made are.
    return _view(context, builder, (kind, result), value, lambda a, b: (a[:-1], b[:-1], 8 * WIDTH))


@_instructions
def in_lanes(typingctx: Any, arrays: Any) -> Any:
    """Arrays of doubles as arrays of lanes, without a copy: of a contiguous array (…, 8), or a
    named tuple, also nested, whose `arrays` of doubles all are such. Another length is not noticed:
    the lanes would be those of other memory. (`typingctx`: see `fused`.)
    """

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _to_lanes(context, builder, arrays, args[0])

    return signature(_lanes_type(arrays), arrays), lower


@_instructions
def numbers_in_lanes(typingctx: Any, arrays: Any) -> Any:
    """A named tuple of `arrays` (8,) of doubles as the same tuple of lanes; `typingctx` is numba's
    own.
    """
    result = types.NamedUniTuple(LANES, len(arrays), arrays.instance_class)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        loaded = []
        for kind, value in zip(arrays, cgutils.unpack_tuple(builder, args[0]), strict=True):
            data = make_array(kind)(context, builder, value).data
            vector = builder.bitcast(data, _VECTOR.as_pointer())
            loaded.append(builder.load(vector, align=8))
        return context.make_tuple(builder, result, loaded)

    return signature(result, arrays), lower


@_instructions
def in_numbers(typingctx: Any, array: Any) -> Any:
    """Lanes, an `array` (…), as an array (…, 8) of doubles, without a copy: the inverse of
    `in_lanes`. (`typingctx`: see `fused`.)
    """
    result = types.Array(types.float64, array.ndim + 1, "C")

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lanes, size = (context.get_constant(types.intp, n) for n in (WIDTH, 8))
        return _view(
            context, builder, (array, result), args[0],
            lambda shape, strides: ([*shape, lanes], [*strides, size], 8),
        )  # fmt: skip

    return signature(result, array), lower


def with_lanes(arrays: Any) -> Any:
    """New arrays for `in_lanes`, all zero: with an array (…, 8) in the place of each array (…) of
    doubles of `arrays`, an array or a named tuple of them, also nested; integers are kept as they
    are.
    """
    if isinstance(arrays, tuple):
        return type(arrays)(*(with_lanes(member) for member in arrays))
    return aligned((*arrays.shape, WIDTH)) if arrays.dtype == float else arrays


# Cody and Waite's three parts of π/2, and the polynomials of fdlibm's sine and cosine (Sun
# Microsystems 1993) on -π/4 ... π/4: errors below one unit in the last place. The first two parts
# have 33 bits each, so that their product with a number of quarter turns of up to 20 bits is exact
# in the 53 bits of a double; the third is what is left of π/2.
_PI_1, _PI_2, _PI_3 = (
    1.57079632673412561417e00,
    6.07710050630396597660e-11,
    2.02226624879595063154e-21,
)


@njit_borrowing
def sine_cosine(x: Any) -> Any:
    """Sine and cosine of the angle `x` (rad) of up to 1e5 or so, a double or lanes, to less than
    one unit in the last place (fdlibm, Sun Microsystems 1993).
    """
    # x = turns · π/2 + y with |y| ≤ π/4. One subtraction of turns · π/2 would cancel the leading
    # digits and leave its rounding error; three, of the parts in order of size, do not.
    turns = nearest(x * 0.63661977236758138)
    y = ((x - turns * _PI_1) - turns * _PI_2) - turns * _PI_3
    z = y * y
    # Horner's scheme from the last coefficient on, with the leading term (y of the sine, 1 of the
    # cosine) added last, so that only its rounding counts. Another order would round differently.
    s = -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10
    s = 2.75573137070700676789e-06 + z * s
    s = -1.98412698298579493134e-04 + z * s
    s = 8.33333333332248946124e-03 + z * s
    s = y + y * z * (-1.66666666666666324348e-01 + z * s)
    c = 2.08757232129817482790e-09 + z * -1.13596475577881948265e-11
    c = -2.75573143513906633035e-07 + z * c
    c = 2.48015872894767294178e-05 + z * c
    c = -1.38888888888741095749e-03 + z * c
    c = 1.0 - (0.5 * z - z * z * (4.16666666666666019037e-02 + z * c))
    # turns modulo 4 is the quadrant. Its last bit exchanges sine and cosine, (c, -s), its second
    # bit turns both by π, (-s, -c). Bits are found with `floor`, because lanes have no integers.
    half = 0.5 * turns
    odd = half != floor(half)
    quarter = 0.5 * floor(half)
    sine, cosine = where(odd, c, s), where(odd, -s, c)
    back = quarter != floor(quarter)
    return where(back, -sine, sine), where(back, -cosine, cosine)


@njit_borrowing
def exponential(x: Any) -> Any:
    """eˣ of `x`, a double or lanes; beyond -700 ... 700 that of the bound. NaN is passed on."""
    # Within ±700 2ⁿ is a normal double, which `power_of_two` needs. NaN is neither below nor above.
    x = where(x < -700.0, -700.0, x)
    x = where(x > 700.0, 700.0, x)
    # x = n · ln 2 + r with |r| ≤ ½ ln 2, ln 2 in two parts as π/2 is in three above.
    n = nearest(x * 1.44269504088896338700)
    r = (x - n * 6.93147180369123816490e-01) - n * 1.90821492927058770002e-10
    # Taylor's polynomial of degree 13 on ±½ ln 2: truncated at 4e-18.
    p = 1 / 479001600 + r * (1 / 6227020800)
    p = 1 / 3628800 + r * (1 / 39916800 + r * p)
    p = 1 / 40320 + r * (1 / 362880 + r * p)
    p = 1 / 720 + r * (1 / 5040 + r * p)
    p = 1 / 24 + r * (1 / 120 + r * p)
    p = 1 / 2 + r * (1 / 6 + r * p)
    p = 1.0 + r * (1.0 + r * p)
    return p * power_of_two(n)


@njit_borrowing
def remainder(x: Any, divisor: float) -> Any:
    """`x` modulo a positive `divisor`, lane by lane, as Python has it: 0 to less than `divisor`."""
    for i in range(width(x)):
        x = with_lane(x, i, lane(x, i) % divisor)
    return x


@njit_borrowing
def arctangent(y: Any, x: Any) -> Any:
    """Angle (rad, -π to π) of the point (`x`, `y`) from the x axis, both doubles or both lanes.

    It is a library's, lane by lane: unlike sine and cosine, which are this module's, its last bit
    may differ from machine to machine.
    """
    angle = y
    for i in range(width(y)):
        angle = with_lane(angle, i, math.atan2(lane(y, i), lane(x, i)))
    return angle
