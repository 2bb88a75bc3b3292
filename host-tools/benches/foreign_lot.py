"""greyrig calibrate and monitor on a lot of motors of the plant of foreign_plant.py, which shares nothing with the project.

    venv/bin/python host-tools/benches/foreign_lot.py target/release/greyrig --seed 1

A 1.4 kW universal motor of one design with saturation, hysteresis, a contact drop and few arcs (--motor drill: one for 120 V and 60 Hz;
--motor "magnet 24 V": one with magnets, on direct voltage); each parameter of each motor is scattered; 8 s of voltage in steps, the same for
all. The model is identified on the first healthy motors with its effects named, limits are
from ten motors. Then healthy motors that nobody has seen, and motors with a fault that begins at a random time between 4 and 5 s, or is there
from the start (--from-start). --rate and --window are those of another rig: samples a second, and a speed that is the mean over so many s.

--warm: winding and bearing warm up, and the mains are up to 3 % off. --mixed: the form of each motor's laws is drawn, too.
Columns: fault, failed, right name first, named among the first three, median of the told begin less the true one s, median ratio to the limit; what was named.
"""

import argparse
import collections
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numba
import numpy as np

import foreign_plant as plant
from foreign_plant import AT, NAMES, STEPS_HZ

SECONDS = 8
UNIVERSAL = dict(knee=8.0, sharpness=2.2, law=0, linked=0.5, lag_current=0.25, brush=2.5, brush_width=0.4, bars=24, arcs=0.005, arc=25.0)
DESIGNS = {
    "vacuum": dict(plant.MOTORS["vacuum"], **UNIVERSAL),
    "drill": dict(plant.MOTORS["drill"], **UNIVERSAL | dict(knee=11.0, lag_current=0.35, arc=20.0)),
    "magnet 24 V": dict(plant.MOTORS["magnet 24 V"], brush=0.8, brush_width=0.1, bars=12, arcs=0.005, arc=4.0),
}
EFFECTS = {"vacuum": ["saturation", "hysteresis", "brush_drop"], "drill": ["saturation", "hysteresis", "brush_drop"], "magnet 24 V": ["brush_drop"]}
LEVELS = dict(
    steps=[0.45, 0.7, 0.9, 1.0, 0.8, 0.6, 0.95, 0.75],
    other=[0.6, 0.95, 0.5, 0.85, 1.0, 0.7, 0.9, 0.55],
)
USUAL = dict(nominal=1e9, stribeck_speed=100, exponent=2, exponent_speed=1, warm_time=4, heat_time=60,
             other_R=1, other_K=1, other_J=1, other_mu0=1, other_L=1, other_mu2=1)
# Name of the fault: changes of the plant, of the chain, and the words of what may be named first; of the universal motor of 1.4 kW.
# Volts, amperes and newton metres are scaled to those of another.
FAULTS = {
    "nothing": ({}, {}, ()),
    "R +15 %": (dict(other_R=1.15), {}, ("resistance", "contact")),
    "R +5 %": (dict(other_R=1.05), {}, ("resistance", "contact")),
    "field turns -8 %": (dict(other_K=0.92, other_L=0.88), {}, ("turns", "flux")),
    "armature turns -6 %": (dict(other_K=0.94, other_R=0.97), {}, ("turns", "flux")),
    "contact +4 V": (dict(other_brush=4.0), {}, ("contact", "resistance")),
    "sparking 30 %": (dict(other_arcs=0.3), {}, ("spark",)),
    "bearing +0.05 N m": (dict(other_load=0.05), {}, ("friction", "bearing")),
    "duct blocked": (dict(other_mu2=0.75), {}, ("load",)),
    "imbalance": (dict(other_imbalance=0.15), dict(w_ripple=0.003), ("imbalance",)),
    "offset of i 0.3 A": ({}, dict(i_offset=0.3), ("offset",)),
    "gain of u +5 %": ({}, dict(u_gain=0.05), ("voltage",)),
    "gain of i drifts 5 %": ({}, dict(i_drift=0.05), ("current",)),
    "gain of w drifts 3 %": ({}, dict(w_drift=0.03), ("speed",)),
}


@numba.njit
def seeded(seed):
    np.random.seed(seed)


def motor(random, options):
    p = np.zeros(len(NAMES))
    values = {**USUAL, **DESIGNS[options.motor]}
    scattered = ("R", "L", "K", "J", "mu0", "mu1", "mu2", "knee", "lag_current", "brush")
    for name in scattered:
        factor = float(np.exp(options.scatter * random.standard_normal()))
        if name in values:
            values[name] *= factor
    if options.mixed:
        values |= dict(law=int(random.integers(3)), sharpness=float(random.uniform(1.8, 3)), linked=float(random.choice([0, 0.5])))
    if options.warm:
        values |= dict(warm=0.4, warm_time=4.0, heat=0.2 / plant.SUPPLY[options.motor][2] ** 2, heat_time=20.0)
    for name, value in values.items():
        p[AT[name]] = value
    return p


def record(path, seed, fault, options, profile="steps", noise_seed=0):
    random = np.random.default_rng([options.seed, seed])
    p = motor(random, options)
    random = np.random.default_rng([options.seed, seed, noise_seed])
    changes, chain, _ = FAULTS[fault]
    at_s = 1e-3 if options.from_start else float(random.uniform(4, 5))
    peak, hertz, largest, top = plant.SUPPLY[options.motor]
    volts, amperes = peak / plant.SUPPLY["vacuum"][0], largest / plant.SUPPLY["vacuum"][2]
    torque = volts * amperes / (top / plant.SUPPLY["vacuum"][3])
    scale = dict(other_brush=volts, other_load=torque, other_imbalance=torque)
    for name, value in changes.items():
        p[AT[name]] = value * scale.get(name, 1.0)
    p[AT["change"]] = at_s / SECONDS if changes else 0.0
    rate = options.rate
    steps, samples = STEPS_HZ // rate, SECONDS * rate
    t = np.arange(samples * steps + 1) / STEPS_HZ
    levels = np.asarray(LEVELS[profile])
    level = levels[np.minimum((t / t[-1] * len(levels)).astype(int), len(levels) - 1)]
    mains = 1 + (random.uniform(-0.03, 0.03) if options.warm else 0.0)
    wave = np.sin(2 * np.pi * hertz * t) + 0.02 * np.sin(6 * np.pi * hertz * t + 1) + 0.01 * np.sin(10 * np.pi * hertz * t + 2)
    supply = peak * mains * level * (wave if p[AT["universal"]] else 1.0)
    seeded(int(random.integers(2**31)))
    u, i, w = plant.run(samples, steps, 1 / STEPS_HZ, supply, np.zeros(samples, bool), False, p, np.zeros(samples))
    after = np.clip((np.arange(samples) / rate - at_s) / 1e-9, 0, 1)
    ramp = np.clip((np.arange(samples) / rate - at_s) / 5.0, 0, 1)
    i = i * (1 + chain.get("i_drift", 0) * ramp) + amperes * chain.get("i_offset", 0) * after
    angle = np.cumsum(w) / rate
    w = w * (1 + chain.get("w_drift", 0) * ramp + chain.get("w_ripple", 0) * np.sin(angle) * after)
    u = u * (1 + chain.get("u_gain", 0) * after)
    coded = lambda x, full, noise: np.round((x + noise * random.standard_normal(samples)) / (2 * full / 4096)) * (2 * full / 4096)
    u, i = coded(u, 420 * volts, 0.15 * volts), coded(i, 20 * amperes, 0.008 * amperes)
    quantum = 5000 / 4096 * top / plant.SUPPLY["vacuum"][3]
    w = np.round((w + 0.8 * quantum * random.standard_normal(samples)) / quantum) * quantum
    if options.window:  # a counter that shows the mean over its gate until the next
        gate = int(options.window * rate)
        w = np.repeat(w[: samples // gate * gate].reshape(-1, gate).mean(1), gate)
        w = np.concatenate([w[:1].repeat(gate), w])[:samples]
    np.savez(path, t_s=np.arange(samples) / rate, u_v=u.astype(np.float32), i_a=i.astype(np.float32), omega_rad_s=w.astype(np.float32))
    return at_s


def call(*words):
    done = subprocess.run([str(x) for x in words], capture_output=True, text=True)
    if done.returncode not in (0, 1, 4):
        sys.exit(f"{' '.join(str(x) for x in words[:4])} …: {done.stderr.strip()}")
    return done


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("greyrig", help="the program")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--motors", type=int, default=10, help="healthy motors that limits are from")
    parser.add_argument("--healthy", type=int, default=20)
    parser.add_argument("--each", type=int, default=6, help="motors with each fault")
    parser.add_argument("--only", default="", help="faults, a part of their names")
    parser.add_argument("--scatter", type=float, default=0.02)
    parser.add_argument("--motor", default="vacuum", choices=list(DESIGNS))
    parser.add_argument("--rate", type=int, default=10_000)
    parser.add_argument("--window", type=float, default=0.0)
    parser.add_argument("--from-start", action="store_true")
    parser.add_argument("--warm", action="store_true")
    parser.add_argument("--mixed", action="store_true")
    parser.add_argument("--keep", type=Path, help="folder for the recordings and the model")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        healthy_options = argparse.Namespace(**{**vars(options), "from_start": False})
        healthy = [folder / f"healthy-{k}.npz" for k in range(options.motors)]
        for k, path in enumerate(healthy):
            record(path, k, "nothing", healthy_options)
        kind = "universal" if DESIGNS[options.motor]["universal"] else "pm-dc"
        model, station = folder / "model.toml", folder / "station.toml"
        effects = EFFECTS[options.motor] + (["winding_temperature", "bearing_warmup"] if options.warm else [])
        named = [word for effect in effects for word in ("--effect", effect)]
        call(options.greyrig, "identify", *healthy[:3], "--kind", kind, *named, "--out", model, "--force")
        call(options.greyrig, "calibrate", *healthy, "--model", model, "--out", station, "--force")
        print(f"{'fault':22} {'failed':>8} {'right':>6} {'in 3':>5} {'delay':>7} {'ratio':>7}")
        for number, (fault, (_, _, names)) in enumerate(FAULTS.items()):
            if options.only and options.only not in fault or fault == "duct blocked" and not DESIGNS[options.motor].get("mu2"):
                continue
            count = options.healthy if fault == "nothing" else options.each
            if fault == "nothing" and options.from_start:
                continue
            failed = right = among = 0
            delays, ratios, told = [], [], collections.Counter()
            for k in range(count):
                path = folder / f"motor-{number}-{k}.npz"
                at_s = record(path, 1000 * (number + 1) + k, fault, options)
                answer = json.loads(call(options.greyrig, "monitor", path, "--model", station, "--json").stdout)
                if not options.keep:
                    path.unlink()
                run = answer["runs"][0]
                findings = run.get("findings") or []
                suspects = [f["text"] for f in findings] or [s["text"] for s in run["suspects"]]
                ratios.append(max([f["ratio"] for f in findings] + [a["ratio"] for a in run["alarms"]], default=0))
                if answer["verdict"] == "fail":
                    failed += 1
                    told[suspects[0] if suspects else "?"] += 1
                    right += bool(suspects) and any(name in suspects[0] for name in names)
                    among += any(name in text for text in suspects[:3] for name in names)
                    delays += [f["t_s"] - at_s for f in findings[:1] if f["t_s"] is not None]
            middle = lambda x: f"{np.median(x):7.2f}" if x else "      -"
            print(f"{fault:22} {failed:4}/{count:<3} {right:6} {among:5} {middle(delays)} {middle(ratios)}  "
                  + "; ".join(f"{n} x {text}" for text, n in told.most_common(3)), flush=True)


if __name__ == "__main__":
    main()
