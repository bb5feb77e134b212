"""Bounds of error bars: none is wider than what the scalar found can be off by, whatever the true one is.

True tractions lie within mu p everywhere, and true pressures carry the load P. So

- forces lie within mu P either way: the true one is at most mu P + |F| from a force F that was found;
- the slip area lies between 0 and the contact's, which is known to within its own bar;
- the largest traction lies between 0 and mu times the largest pressure, which is known to within its own bar.

On few cells, or where scales do not suit the bodies, the sum of all parts of a bar may be larger.
"""

from __future__ import annotations

from rcstudy.mechanics.scene import Scene


def within(bars: dict[str, float], found: dict[str, float], scene: Scene) -> dict[str, float]:
    """The error `bars` of the scalars `found`, in their units, lowered to these bounds where they exceed them."""
    force, forces = scene.friction * scene.load, found.keys() & {"force_x", "force_y"}
    most = {name: force + abs(found[name]) for name in forces}
    for name, of, factor in (("slip_area", "contact_area", 1.0), ("traction_max", "pressure_max", scene.friction)):
        if name in found:
            largest = factor * (found[of] + bars[of])
            most[name] = max(found[name], largest - found[name])
    return {name: min(bar, most.get(name, bar)) for name, bar in bars.items()}
