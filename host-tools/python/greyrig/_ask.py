"""The questions: one function for each command."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any, Literal, TypeAlias

from . import _native
from ._model import Model, load_model
from ._progress import Progress, watching
from ._recording import Map, Recording, Recordings, natives
from ._results import (
    Addition,
    Calibration,
    Check,
    Comparison,
    Diagnosis,
    Identification,
    Monitoring,
    Prediction,
    Training,
    result,
)

Path: TypeAlias = "str | os.PathLike[str]"
Kind: TypeAlias = Literal["universal", "pm-dc"]
Base: TypeAlias = Literal["full", "dry-viscous", "viscous", "dry", "frictionless"]
Course: TypeAlias = Literal["smooth", "linear", "held", "mean", "edges"]
Names: TypeAlias = "str | Iterable[str]"


def _names(names: Names) -> list[str]:
    return [names] if isinstance(names, str) else list(names)


def _to(out: Path | None, force: bool) -> dict[str, Any]:
    return {"out": None if out is None else os.fspath(out), "force": force}


def _native_model(model: Model | Path) -> _native.Model:
    loaded = model if isinstance(model, Model) else load_model(model)
    return loaded._native


def identify(
    recordings: Recordings,
    *,
    kind: Kind | None = None,
    method: Literal["output-error", "least-squares"] = "output-error",
    base: Base | None = None,
    effects: Names = (),
    terms: Names = (),
    fix: Mapping[str, float] | None = None,
    bound: Mapping[str, tuple[float, float]] | None = None,
    input: Course | None = None,
    cutoff_hz: float | None = None,
    order: int = 4,
    map: Map | None = None,
    out: Path | None = None,
    force: bool = False,
    progress: bool | Progress | None = None,
    threads: int | None = None,
) -> Identification:
    """Physical parameters with 95 % intervals from recordings of one motor type.

    ``fix`` and ``bound`` are in SI units. ``out`` is a model file to write beside the answer.
    """
    options = {
        "kind": kind,
        "method": method,
        "base": base,
        "effects": _names(effects),
        "terms": _names(terms),
        "fix": list((fix or {}).items()),
        "bound": [(name, low, high) for name, (low, high) in (bound or {}).items()],
        "input": input,
        "cutoff_hz": cutoff_hz,
        "order": order,
    }
    with watching(progress, threads) as watch:
        given = natives(recordings, map, watch)
        return result(Identification, _native.identify(given, options, _to(out, force), watch))


def compare(
    recordings: Recordings,
    model: Model | Path,
    *,
    input: Course | None = None,
    map: Map | None = None,
    out: Path | None = None,
    force: bool = False,
    progress: bool | Progress | None = None,
    threads: int | None = None,
) -> Comparison:
    """A model against recordings, and where it fails. ``out`` is a file for the series."""
    known = _native_model(model)
    with watching(progress, threads) as watch:
        given = natives(recordings, map, watch)
        return result(Comparison, _native.compare(given, known, input, _to(out, force), watch))


def diagnose(
    recordings: Recordings,
    model: Model | Path | None = None,
    *,
    kind: Kind | None = None,
    base: Base | None = None,
    fix: Mapping[str, float] | None = None,
    exclude: Names = (),
    input: Course | None = None,
    map: Map | None = None,
    progress: bool | Progress | None = None,
    threads: int | None = None,
) -> Diagnosis:
    """Which physical effect is missing, how sure, what it is confused with, and the experiment that would tell.

    Without a model the base model is identified; ``kind`` and ``base`` are for that.
    """
    known = None if model is None else _native_model(model)
    options = {
        "kind": kind,
        "base": base,
        "fix": list((fix or {}).items()),
        "exclude": _names(exclude),
        "input": input,
    }
    with watching(progress, threads) as watch:
        given = natives(recordings, map, watch)
        return result(Diagnosis, _native.diagnose(given, known, options, watch))


def add(
    effects: Names,
    recordings: Recordings,
    model: Model | Path,
    *,
    terms: Names = (),
    map: Map | None = None,
    out: Path | None = None,
    force: bool = False,
    progress: bool | Progress | None = None,
    threads: int | None = None,
) -> Addition:
    """Effects of the catalogue, or terms of your own such as ``k*i*abs(i)``, added to a model.

    With several recordings the gain is judged on the last one, which the fit does not see; with a single one, on the
    last third of the time until all is at rest.
    """
    known = _native_model(model)
    with watching(progress, threads) as watch:
        given = natives(recordings, map, watch)
        return result(
            Addition, _native.add(_names(effects), _names(terms), given, known, _to(out, force), watch)
        )


def predict(
    voltage: Recordings,
    model: Model | Path,
    *,
    input: Literal["held", "linear", "as-fitted"] = "as-fitted",
    initial: Mapping[str, float] | None = None,
    band: float | None = None,
    map: Map | None = None,
    out: Path | None = None,
    force: bool = False,
    progress: bool | Progress | None = None,
    threads: int | None = None,
) -> Prediction:
    """The model's free run on any voltage.

    ``voltage`` is one recording, file or frame with ``t_s`` and ``u_v``; ``band`` is a percentage, such as 95;
    ``initial`` is the state at the first sample (``i_a``, ``omega_rad_s``).
    """
    known = _native_model(model)
    options = {"input": input, "initial": list((initial or {}).items()), "band": band}
    with watching(progress, threads) as watch:
        given = natives(voltage, map, watch)
        if len(given) != 1:
            raise ValueError(f"a prediction takes one voltage, and {len(given)} are given")
        return result(Prediction, _native.predict(given[0], known, options, _to(out, force), watch))


def check(
    recordings: Recordings,
    *,
    kind: Kind | None = None,
    map: Map | None = None,
    progress: bool | Progress | None = None,
    threads: int | None = None,
) -> Check:
    """What is wrong with recordings, and what mends it; the first step of every other question, too."""
    with watching(progress, threads) as watch:
        return result(Check, _native.check(natives(recordings, map, watch), kind, watch))


def train(
    recordings: Recordings,
    model: Model | Path,
    *,
    blanking_s: float = 1.0,
    epochs: int = 60,
    method: Literal["varpro", "hybrid"] = "varpro",
    bell: Literal[1, 2] | None = None,
    ridge: float | None = None,
    firing: Literal["product", "min"] = "product",
    delay_s: float | None = None,
    map: Map | None = None,
    out: Path | None = None,
    force: bool = False,
    progress: bool | Progress | None = None,
    threads: int | None = None,
) -> Training:
    """The learned correction (ANFIS) of what the physical model leaves over, judged on data held out."""
    known = _native_model(model)
    options = {
        "blanking_s": blanking_s,
        "epochs": epochs,
        "method": method,
        "bell": bell,
        "ridge": ridge,
        "firing": firing,
        "delay_s": delay_s,
    }
    with watching(progress, threads) as watch:
        given = natives(recordings, map, watch)
        return result(Training, _native.train(given, known, options, _to(out, force), watch))


def calibrate(
    recordings: Recordings,
    model: Model | Path,
    *,
    blanking_s: float = 1.0,
    false_alarms: float = 1e-3,
    unlabelled: bool = False,
    map: Map | None = None,
    out: Path | None = None,
    force: bool = False,
    progress: bool | Progress | None = None,
    threads: int | None = None,
) -> Calibration:
    """The detector's limits from runs of healthy motors, all of them on the profile of the test.

    ``false_alarms``: the share of healthy motors that may fail. ``unlabelled``: a few of the motors may be bad, a
    quarter at most; those that the others do not take for theirs are named and teach nothing.
    """
    known = _native_model(model)
    options = {"blanking_s": blanking_s, "false_alarms": false_alarms, "unlabelled": unlabelled}
    with watching(progress, threads) as watch:
        given = natives(recordings, map, watch)
        return result(Calibration, _native.calibrate(given, known, options, _to(out, force), watch))


def monitor(
    recordings: Recordings,
    model: Model | Path,
    *,
    motor: str | None = None,
    serial: str | None = None,
    air_hpa: float | None = None,
    temp_c: float | None = None,
    map: Map | None = None,
    progress: bool | Progress | None = None,
    threads: int | None = None,
) -> Monitoring:
    """Judges motors on recordings of one run each, with a model that has limits from :func:`calibrate`."""
    known = _native_model(model)
    options = {"motor": motor, "serial": serial, "air_hpa": air_hpa, "temp_c": temp_c}
    with watching(progress, threads) as watch:
        given = natives(recordings, map, watch)
        return result(Monitoring, _native.monitor(given, known, options, watch))


def simulate(
    *,
    kind: Kind = "universal",
    effects: Names = (),
    faults: Names = (),
    hidden: int | None = None,
    profile: str | None = None,
    seed: int = 0,
    seconds: float | None = None,
    peak_voltage: float | None = None,
    mains_hz: int = 50,
    spread: float = 0.0,
    noise: float = 1.0,
    turbulence: float = 0.003,
    fifth_harmonic: float = 0.0,
    rate_hz: float | None = None,
    speed_sensor: str | None = None,
    reveal: bool = False,
    name: str = "simulated",
    progress: bool | Progress | None = None,
    threads: int | None = None,
) -> Recording:
    """A recording from the virtual rig; the same arguments give the same bits.

    ``effects`` are written ``ID[:FORM][=SIZE]``, ``faults`` ``ID[=SIZE][@T]``; ``greyrig simulate --list`` has them.
    """
    options = {
        "kind": kind,
        "effects": _names(effects),
        "faults": _names(faults),
        "hidden": hidden,
        "profile": profile,
        "seed": seed,
        "seconds": seconds,
        "peak_voltage": peak_voltage,
        "mains_hz": mains_hz,
        "spread": spread,
        "noise": noise,
        "turbulence": turbulence,
        "fifth_harmonic": fifth_harmonic,
        "rate_hz": rate_hz,
        "speed_sensor": speed_sensor,
        "reveal": reveal,
        "name": name,
    }
    with watching(progress, threads) as watch:
        return Recording(_native.simulate(options, watch))
