"""A value out of its range, in words: whether it looks like another unit, or a swapped column."""

from collections.abc import Mapping

Range = tuple[float, float]


def _within(value: float, limits: Range) -> bool:
    return limits[0] <= value <= limits[1]


def no_body(
    mass: float, height: float, mass_range: Range, height_range: Range, of_both: Range
) -> list[str]:
    """What is wrong with a body `mass` (kg) and a stature `height` (m) outside the plausible
    `mass_range` and `height_range`, or `of_both`: their body mass index, kg/m².
    """

    def plausible(mass: float, height: float) -> bool:
        each = _within(mass, mass_range) and _within(height, height_range)
        return each and _within(mass / height**2, of_both)

    swapped = [
        (new_mass, new_height)
        for new_height in (mass, mass / 100)
        for new_mass in (height, height * 100)
        if plausible(new_mass, new_height)
    ]
    seen = f"mass_kg = {mass:g} and height_m = {height:g}"
    if plausible(mass, height / 100):
        return [
            f"height_m = {height:g}: this looks like centimetres. "
            f"Give metres: height_m = {height / 100:g}."
        ]
    if swapped:
        new_mass, new_height = swapped[0]
        return [
            f"{seen}: the columns look swapped (a body mass of {mass:g} kg at {height:g} m is "
            f"impossible, {new_mass:g} kg at {new_height:g} m is not). "
            f"Give mass_kg = {new_mass:g} and height_m = {new_height:g}."
        ]
    if plausible(mass * 0.45359237, height):
        return [
            f"mass_kg = {mass:g}: with height_m = {height:g} the body mass index is "
            f"{mass / height**2:.1f} kg/m², outside {of_both[0]:g}-{of_both[1]:g}; this looks like "
            f"pounds. Give kilograms: mass_kg = {mass * 0.45359237:.1f}."
        ]
    if plausible(mass, height * 0.3048):
        return [
            f"height_m = {height:g}: this looks like feet. "
            f"Give metres: height_m = {height * 0.3048:.3f}."
        ]
    problems = [
        f"{name} = {value:g}: outside {limits[0]:g}-{limits[1]:g} {unit}. Check value and unit."
        for name, value, limits, unit in (
            ("mass_kg", mass, mass_range, "kg"),
            ("height_m", height, height_range, "m"),
        )
        if not _within(value, limits)
    ]
    return problems or [
        f"{seen}: the body mass index is {mass / height**2:.1f} kg/m², outside "
        f"{of_both[0]:g}-{of_both[1]:g}. Check both values and their units."
    ]


def out_of_range(
    name: str, value: float, limits: Range, unit: str, other_units: Mapping[str, float]
) -> str:
    """A sentence on the `value` of this `name` outside `limits`, in `unit`; `other_units` maps a
    unit's name to the factor from it to `unit`.
    """
    for other, factor in other_units.items():
        if _within(value * factor, limits):
            return (
                f"{name} = {value:g}: this looks like {other}; "
                f"give {unit}: {name} = {value * factor:g}."
            )
    return (
        f"{name} = {value:g}: outside the plausible {limits[0]:g}-{limits[1]:g} {unit}. "
        "Check value and unit."
    )
