"""The road of a study: its profile, the speed over it, and the signal of every input that reads it."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.checks import unknown
from qddot.runner.inputs.csv_table import samples_from_csv, table_from_csv
from qddot.runner.inputs.drive import Way, roads_at
from qddot.runner.inputs.formulas import units_of
from qddot.runner.inputs.iso8608 import CLASSES, LONGEST, SHORTEST, random_road
from qddot.runner.inputs.signal import Signal
from qddot.runner.inputs.tables import table, table_at
from qddot.runner.load import Model
from qddot.runner.study.amounts import Amounts
from qddot.runner.study.road_kinds import FORMULAS, Road


def road_signals(
    spec: Any,
    model: Model,
    p: NDArray[np.float64],
    span: tuple[float, float],
    amounts: Amounts,
    profile: Signal | None = None,
) -> dict[str, Signal]:
    """Signals by name of the inputs that read the road, for parameters p.

    profile: the road as `road_profile` gives it, where the caller has it already.
    """
    road = road_profile(spec, amounts) if profile is None else profile
    places, speed = road_positions(spec, model, p, amounts), road_speed(spec, amounts)
    start = amounts("road.start", spec.start, "m")
    if spec.kind == "iso8608":
        _check_reach(spec, places, span, amounts)
    with amounts.at("road"):
        return roads_at(road, places, speed, start, span)


def profile_of(spec: Any) -> str:
    """The keys on which the profile of a road depends, in one text."""
    return str(spec.model_dump_json(exclude=set(Road.model_fields)))


def road_profile(spec: Any, amounts: Amounts) -> Signal:
    """Height over distance, m: it depends on the keys of the profile alone, not on speed, start or model."""
    with amounts.at("road"):
        if spec.kind in FORMULAS:
            formula = FORMULAS[spec.kind]
            return formula(**amounts.given("road", spec, units_of(formula, "m")))
        return _BUILD[spec.kind](spec, amounts)


def road_positions(spec: Any, model: Model, p: NDArray[np.float64], amounts: Amounts) -> dict[str, float]:
    """Where each input reads the road, m ahead of the model's origin: what the model says, changed by the study."""
    places = model.positions(p)
    inputs = model.tables.free_inputs
    for name, place in spec.positions.items():
        key = f"road.positions.{name}"
        if name not in inputs:
            raise amounts.wrong(key, unknown("input", name, inputs))
        places[name] = amounts(key, place, "m")
    if not places:
        name = inputs[0] if inputs else "NAME"
        raise amounts.wrong(
            "road", f"model {model.name} does not say which inputs read a road; give positions = {{ {name} = 0 }}"
        )
    return places


def road_speed(spec: Any, amounts: Amounts) -> float | Signal:
    """A constant speed in m/s, or its table over time."""
    if (spec.speed is None) == (spec.speed_profile is None):
        raise amounts.wrong("road", 'give either speed, such as "20 km/h", or speed_profile')
    if spec.speed is not None:
        return amounts("road.speed", spec.speed, "m/s")
    profile, key = spec.speed_profile, "road.speed_profile"
    inline = profile.t is not None and profile.v is not None
    if inline == (profile.file is not None):
        raise amounts.wrong(key, "give either file, or t and v")
    with amounts.at(key):
        if inline:
            t = [amounts(f"{key}.t", each, "s") for each in profile.t]
            return table(t, [amounts(f"{key}.v", each, "m/s") for each in profile.v])
        units = {"time_unit": profile.time_unit, "value_unit": profile.speed_unit}
        file = amounts.file(f"{key}.file", profile.file)
        return table_from_csv(file, time=profile.time, value=profile.speed, unit="m/s", **units)


def road_reach(
    spec: Any, places: Mapping[str, float], span: tuple[float, float], amounts: Amounts
) -> tuple[float, float]:
    """The first and the last distance on the road that a run over the span reads, m."""
    speed, start = road_speed(spec, amounts), amounts("road.start", spec.start, "m")
    if isinstance(speed, Signal):
        with amounts.at("road.speed_profile"):
            low, high = Way.of(speed, span).range
    else:
        low, high = sorted(speed * t for t in span)
    return start + low + min(places.values()), start + high + max(places.values())


def random_road_roughness(spec: Any, amounts: Amounts) -> float:
    """Gd(n0) of a random road, m^3, given as such or as a class."""
    given = spec.roughness
    return CLASSES[given] if given in CLASSES else amounts("road.roughness", given, "m^3")


def _check_reach(spec: Any, places: Mapping[str, float], span: tuple[float, float], amounts: Amounts) -> None:
    """A random road that ends during the run would go on as level ground, unnoticed."""
    length = amounts("road.length", spec.length, "m")
    _, reach = road_reach(spec, places, span, amounts)
    if reach > length:
        raise amounts.wrong(
            "road.length", f"the run reads the road up to {reach:.4g} m, but it ends at {length:.4g} m; make it longer"
        )


def _measured(spec: Any, amounts: Amounts) -> Signal:
    inline = spec.x is not None and spec.z is not None
    if inline == (spec.file is not None):
        raise amounts.wrong("road", "give either file, or x and z")
    if inline:
        inline_x, inline_z = (
            np.array([amounts(f"road.{name}", each, "m") for each in getattr(spec, name)]) for name in ("x", "z")
        )
        return table_at(inline_x, inline_z, spec.interpolation, None, lambda i: f"sample {i}", "distance")
    x, z, place = samples_from_csv(
        amounts.file("road.file", spec.file),
        spec.distance,
        spec.height,
        spec.distance_unit,
        spec.height_unit,
        unit="m",
        resample=amounts.given("road", spec, {"resample": "m"}).get("resample"),
        argument=("distance", "m"),
    )
    return table_at(x, z, spec.interpolation, None, place, "distance")


def _random(spec: Any, amounts: Amounts) -> Signal:
    waves = {"shortest": SHORTEST, "longest": LONGEST}
    sizes = amounts.given("road", spec, {"length": "m", "shortest": "m", "longest": "m", "fade": "m"})
    return random_road(random_road_roughness(spec, amounts), seed=spec.seed, waviness=spec.waviness, **(waves | sizes))


_BUILD: Mapping[str, Callable[[Any, Amounts], Signal]] = {"profile": _measured, "iso8608": _random}
