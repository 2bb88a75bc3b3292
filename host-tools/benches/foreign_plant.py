"""greyrig diagnose on motors of a plant that shares nothing with the project: not its language, its equations' code, its integrator,
its measuring chain, its motors or the sizes of its effects.

    python3 -m venv venv
    venv/bin/pip install numpy scipy numba
    cargo build --release -p greyrig-host --bin greyrig
    venv/bin/python host-tools/benches/foreign_plant.py target/release/greyrig --seed 1

Three universal motors (230 V 50 Hz vacuum cleaner and blender, 120 V 60 Hz drill) and two magnet motors (24 V, 12 V), each parameter
scattered by a tenth; mains with third and fifth harmonics; 5, 10 or 20 kHz; no anti-alias filters, so that direct voltages switch
from one sample to the next. Classical Runge-Kutta at 100 kHz:

    u = R i + drop(i) + K s phi w + L_d di/dt          J dw/dt = K s phi i - friction(w) - load(w) - iron(i, w)

One effect of moderate size a case, two in some, none in some. Columns of the table: motor, truth, excitation, verdict. --noise 0 is a
recording without any noise, --noise 5 one with five times the usual.

--foreign draws what the catalogue lacks: a parameter that is another one from some time on, a contact drop that grows with the
speed, a load that goes with the angle, samples that are lost unseen, a clock of the speed of its own. There nothing may be named,
and "none" is wrong where the model is far off.
"""

import argparse
import json
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numba
import numpy as np
from scipy.signal import lfilter

# The plant's parameters; zero means absent.
NAMES = [
    "R", "L", "K", "J", "mu0", "mu1", "mu2", "universal",
    "knee", "sharpness", "law",  # saturation: A, exponent, law
    "inductance_knee", "inductance_lost",  # A, share
    "lag_current", "eddy", "linked",  # hysteresis: A; lag: s; share of the inductance with the flux
    "remanence", "brush", "brush_width",  # A; V, A
    "demagnetisation", "nominal",  # share of the flux lost at the nominal speed, rad/s
    "stribeck", "stribeck_speed", "exponent", "exponent_speed",
    "iron", "warm", "warm_time", "heat", "heat_time", "dead_zone", "asymmetry", "torque",
    "change", "other_R", "other_K", "other_J", "other_mu0",  # share of the time; factors from then on
    "brush_speed", "cam",  # the drop's growth at the nominal speed; N m, three times a turn
    "other_L", "other_mu2", "other_brush", "other_load",  # further of what is another from a time on: factors; V; N m
    "bars", "arcs", "other_arcs", "arc",  # bars a turn; share of their passages with an arc; V
    "other_imbalance",  # N m, once a turn
]
AT = {name: k for k, name in enumerate(NAMES)}
(R, L, K, J, MU0, MU1, MU2, UNIVERSAL, KNEE, SHARPNESS, LAW, IND_KNEE, IND_LOST, LAG_I, EDDY, LINKED, REMANENCE, BRUSH, BRUSH_WIDTH,
 DEMAG, NOMINAL, STRIBECK, STRIBECK_W, EXPONENT, EXPONENT_W, IRON, WARM, WARM_S, HEAT, HEAT_S, DEAD, ASYMMETRY, TORQUE,
 CHANGE, OTHER_R, OTHER_K, OTHER_J, OTHER_MU0, BRUSH_SPEED, CAM, OTHER_L, OTHER_MU2, OTHER_BRUSH, OTHER_LOAD,
 BARS, ARCS, OTHER_ARCS, ARC, OTHER_IMBALANCE) = range(len(NAMES))

MOTORS = {
    "vacuum": dict(R=2.9, L=0.026, K=0.0115, J=2.6e-4, mu0=0.02, mu1=1.2e-5, mu2=3.5e-8, universal=1),
    "drill": dict(R=1.3, L=0.008, K=0.0052, J=6e-5, mu0=0.03, mu1=1e-5, mu2=5e-8, universal=1),
    "blender": dict(R=9.0, L=0.09, K=0.05, J=1.2e-4, mu0=0.015, mu1=8e-6, mu2=9e-8, universal=1),
    "magnet 24 V": dict(R=0.6, L=6e-4, K=0.06, J=8e-5, mu0=0.02, mu1=2e-5, mu2=0, universal=0),
    "magnet 12 V": dict(R=2.0, L=1.2e-3, K=0.025, J=6e-6, mu0=0.004, mu1=1.5e-6, mu2=0, universal=0),
}
# Peak voltage V, mains Hz, typical peak current A, top speed rad/s.
SUPPLY = {
    "vacuum": (325, 50, 8.7, 3000), "drill": (170, 60, 11.8, 2470), "blender": (325, 50, 3.4, 1676),
    "magnet 24 V": (24, 50, 3.0, 380), "magnet 12 V": (12, 50, 0.8, 430),
}
SECONDS = dict(stairs=12, random=12, steps=6, locked=2, coast=8, jumps=8)
SETS = {1: [["stairs"], ["random"], ["stairs", "steps", "locked", "coast"]], 0: [["steps"], ["jumps", "coast"]]}
STEPS_HZ = 100_000


@numba.njit(cache=True)
def flux(x, p):
    if p[KNEE] <= 0:
        return x
    a = abs(x) / p[KNEE]
    if p[LAW] == 0:
        return x / (1 + a ** p[SHARPNESS]) ** (1 / p[SHARPNESS])
    if p[LAW] == 1:
        return p[KNEE] * np.tanh(x / p[KNEE])
    return p[KNEE] * (2 / np.pi) * np.arctan(np.pi / 2 * x / p[KNEE])


@numba.njit(cache=True)
def slopes(t, y, u, locked, is_open, p, out):
    """State: current, speed, flux with hysteresis, flux with lag, warmth."""
    i, w, wide, late, warmth = y
    series = p[UNIVERSAL] > 0.5
    still = flux(i + p[REMANENCE], p)
    inductance = p[L]
    if p[IND_KNEE] > 0:
        inductance *= 1 - p[IND_LOST] + p[IND_LOST] * np.exp(-((i / p[IND_KNEE]) ** 2))
    if p[DEAD] > 0:
        u = u - p[DEAD] if u > p[DEAD] else (u + p[DEAD] if u < -p[DEAD] else 0.0)
    drop = p[BRUSH] * np.tanh(i / p[BRUSH_WIDTH]) if p[BRUSH] > 0 else 0.0
    drop *= 1 + p[BRUSH_SPEED] * abs(w) / p[NOMINAL]
    share = 1 - p[DEMAG] * abs(w) / p[NOMINAL]
    base = wide if p[LAG_I] > 0 else still
    phi = (late if p[EDDY] > 0 else base) if series else 1.0
    rest = u - p[R] * (1 + warmth) * i - drop - p[K] * share * phi * w
    follow = (base - late) / p[EDDY] if p[EDDY] > 0 else 0.0
    if not series or p[LINKED] == 0:
        rate = rest / inductance
    elif p[EDDY] > 0:
        rate = (rest - inductance * p[LINKED] * follow) / (inductance * (1 - p[LINKED]))
    else:
        if p[LAG_I] > 0:
            slope = max(0.0, (still - wide) * np.sign(rest)) / p[LAG_I]
        else:
            slope = (flux(i + p[REMANENCE] + 1e-4, p) - flux(i + p[REMANENCE] - 1e-4, p)) / 2e-4
        rate = rest / (inductance * (1 - p[LINKED] + p[LINKED] * slope))
    if is_open:
        rate = 0.0
    out[0] = rate
    gap = still - wide
    out[2] = abs(gap) / p[LAG_I] * rate if p[LAG_I] > 0 and gap * rate > 0 else 0.0
    out[3] = follow
    driven = 0.0 if is_open else i
    cold = 1 + p[WARM] * np.exp(-t / p[WARM_S])
    dry = p[MU0] * cold + p[STRIBECK] * np.exp(-abs(w) / p[STRIBECK_W])
    viscous = p[MU1] * cold * w * (1 + p[ASYMMETRY] * np.sign(w))
    load = p[MU2] * p[EXPONENT_W] ** 2 * (abs(w) / p[EXPONENT_W]) ** p[EXPONENT] * np.sign(w)
    torque = p[K] * share * phi * driven - viscous - load - p[IRON] * phi * phi * w - p[TORQUE]
    if locked or (abs(w) < 1e-3 and abs(torque) <= dry):
        out[1] = 0.0
    else:
        out[1] = (torque - (np.sign(w) if abs(w) > 1e-3 else np.sign(torque)) * dry) / p[J]
    out[4] = (p[HEAT] * driven * driven - warmth) / p[HEAT_S] if p[HEAT] > 0 else 0.0


@numba.njit(cache=True)
def run(samples, steps, h, supply, is_open, locked, p, gusts):
    y, k1, k2, k3, k4 = np.zeros(5), np.zeros(5), np.zeros(5), np.zeros(5), np.zeros(5)
    voltage, current, speed = np.zeros(samples), np.zeros(samples), np.zeros(samples)
    p, load, t = p.copy(), p[MU2], 0.0
    steady, angle, changed = p[TORQUE], 0.0, False
    bar, burns, imbalance, extinguished = 0.0, 0.0, 0.0, 0.0
    for n in range(samples):
        if p[CHANGE] > 0 and not changed and n > p[CHANGE] * samples:
            p[R], p[K], p[J], p[MU0] = p[R] * p[OTHER_R], p[K] * p[OTHER_K], p[J] * p[OTHER_J], p[MU0] * p[OTHER_MU0]
            p[L], load, p[ARCS] = p[L] * p[OTHER_L], load * p[OTHER_MU2], p[ARCS] + p[OTHER_ARCS]
            p[BRUSH], p[MU0], imbalance = p[BRUSH] + p[OTHER_BRUSH], p[MU0] + p[OTHER_LOAD], p[OTHER_IMBALANCE]
            changed = True
        if is_open[n]:
            y[0] = 0.0
        voltage[n], current[n], speed[n] = supply[n * steps], y[0], y[1]
        if is_open[n]:
            voltage[n] = p[K] * (1 - p[DEMAG] * abs(y[1]) / p[NOMINAL]) * y[1] * (flux(p[REMANENCE], p) if p[UNIVERSAL] > 0.5 else 1.0)
        p[MU2] = load * (1 + gusts[n])
        for q in range(steps):
            a, b = supply[n * steps + q], supply[n * steps + q + 1]
            before = y[1]
            p[TORQUE] = steady + p[CAM] * np.sin(3 * angle) + imbalance * np.sin(angle)
            if p[ARC] > 0:  # a bar that leaves the brush draws an arc that takes voltage for some of its width
                if angle * p[BARS] / (2 * np.pi) > bar:
                    bar += 1
                    burns = np.random.exponential(1.0) if np.random.random() < p[ARCS] else 0.0
                    extinguished = t + 2 * np.pi / (p[BARS] * abs(y[1]) + 1) * min(burns, 1.0)
                if t < extinguished:
                    arc = p[ARC] * min(abs(y[0]) / 1.0, 1.0) * (1.0 if y[0] > 0 else -1.0)
                    a, b = a - arc, b - arc
            slopes(t, y, a, locked, is_open[n], p, k1)
            slopes(t + h / 2, y + h / 2 * k1, (a + b) / 2, locked, is_open[n], p, k2)
            slopes(t + h / 2, y + h / 2 * k2, (a + b) / 2, locked, is_open[n], p, k3)
            slopes(t + h, y + h * k3, b, locked, is_open[n], p, k4)
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            if before * y[1] < 0:
                y[1] = 0.0
            t += h
            angle += h * y[1]
    return voltage, current, speed


def excitation(kind, motor, t, share, random):
    """Voltage at the integration steps."""
    peak, hertz, _, _ = SUPPLY[motor]
    level = lambda levels: np.asarray(levels)[np.minimum((share * len(levels)).astype(int), len(levels) - 1)]
    wave = np.sin(2 * np.pi * hertz * t + 0.3)
    for order, part in ((3, 0.02), (5, 0.01)):
        wave = wave + part * np.sin(order * 2 * np.pi * hertz * t + random.uniform(0, 6))
    universal = MOTORS[motor]["universal"]
    if kind == "stairs":
        return peak * level([0.25, 0.4, 0.55, 0.7, 0.85, 1.0, 0.9, 0.75, 0.6, 0.45, 0.3, 0.2]) * wave
    if kind == "random":
        return peak * level(random.uniform(0.2, 1, 15)) * wave
    if kind == "locked":
        return peak * level([0.05, 0.1, 0.2, 0.3]) * wave
    if kind == "coast":
        return peak * wave if universal else peak * np.ones_like(t)
    if kind == "steps":
        return peak * level([0.08, 0.15, 0.25, 0.35, 0.2, 0.1] if universal else [0.3, 0.6, 1, 0.5, -0.4, -0.8, -1, -0.3])
    return peak * level(random.uniform(-1, 1, 32))


def record(path, motor, kind, rate, seed, effect, chain, noise):
    """Writes a recording. The motor and its effect are those of the seed, the noise that of the kind, too."""
    random = np.random.default_rng(seed)
    p = np.zeros(len(NAMES))
    usual = dict(sharpness=2, brush_width=0.3, nominal=1e9, stribeck_speed=100, exponent=2, exponent_speed=1, warm_time=4, heat_time=15,
                 other_R=1, other_K=1, other_J=1, other_mu0=1, other_L=1, other_mu2=1)
    for name, value in {**usual, **MOTORS[motor]}.items():
        p[AT[name]] = value
    p[R:UNIVERSAL] *= np.exp(0.1 * random.standard_normal(UNIVERSAL))
    for name, value in effect.items():
        p[AT[name]] = value
    steps, samples = STEPS_HZ // rate, SECONDS[kind] * rate
    t = np.arange(samples * steps + 1) / STEPS_HZ
    share = t / t[-1]
    supply = excitation(kind, motor, t, share, random)
    if noise > 0:
        drift = 6e-5 * np.cumsum(random.standard_normal(t.size // 1000 + 2))
        supply = supply * (1 + drift.repeat(1000)[: t.size])
    is_open = (np.arange(samples) / samples > 0.3) if kind == "coast" else np.zeros(samples, bool)
    keep = np.exp(-1 / (0.02 * rate))
    gusts = lfilter([np.sqrt(1 - keep * keep)], [1, -keep], random.standard_normal(samples)) * 0.003 * noise
    u, i, w = run(samples, steps, 1 / STEPS_HZ, supply, is_open, kind == "locked", p, gusts)
    if "delay" in chain:
        i = np.interp(np.arange(samples) - chain["delay"] * rate, np.arange(samples), i)
    if "clock" in chain:
        w = np.interp(np.arange(samples) * (1 + chain["clock"]), np.arange(samples), w)
    if "lag" in chain:
        kept = np.exp(-1 / (chain["lag"] * rate))
        w = lfilter([1 - kept], [1, -kept], w)
    if "compression" in chain:
        i = i / np.sqrt(1 + (i / chain["compression"]) ** 2)
    i, u = i + chain.get("current_offset", 0), u + chain.get("voltage_offset", 0)
    largest, peak = np.percentile(abs(i), 99.9), SUPPLY[motor][0]
    white = lambda size: size * noise * random.standard_normal(samples)
    i, u, w = i + white(0.0015 * largest), u + white(0.001 * peak), w + white(4e-4 * np.max(abs(w)) + 1e-3)
    if "clip" in chain:
        i = np.clip(i, -chain["clip"], chain["clip"])
    if noise > 0:  # a converter of twelve bits
        coded = lambda x, full: np.round(x / (2 * full / 4096)) * (2 * full / 4096)
        i, u = coded(i, 1.6 * largest), coded(u, 1.3 * peak)
    if "lost" in chain:  # rows that the logger has dropped, while its time goes on
        at, count = int(chain["lost"][0] * samples), int(chain["lost"][1] * rate)
        kept = np.r_[0:at, at + count : samples]
        u, i, w, is_open = u[kept], i[kept], w[kept], is_open[kept]
        samples -= count
    columns, header = [np.arange(samples) / rate, u, i, w], "t_s,u_v,i_a,omega_rad_s"
    if is_open.any():
        columns.append(is_open.astype(float))
        header += ",supply_open"
    with open(path, "w") as file:
        file.write(f"# motor: {motor}\n" + ("# rotor: locked\n" if kind == "locked" else "") + header + "\n")
        np.savetxt(file, np.column_stack(columns), fmt="%.7g", delimiter=",")


def effects(motor, random):
    """Truth: parameters of the plant and of its measuring chain."""
    _, _, peak, top = SUPPLY[motor]
    m = MOTORS[motor]
    draw = lambda low, high: float(np.exp(random.uniform(np.log(low), np.log(high))))
    knee = lambda low, high, law: dict(knee=peak * draw(low, high), sharpness=float(random.uniform(1.8, 3)), law=law)
    brush = lambda: dict(brush=m["R"] * peak * draw(0.1, 0.25), brush_width=0.03 * peak)
    linked = lambda: float(random.choice([0, 0.5]))
    torque = m["K"] * (peak * peak / 2 if m["universal"] else peak)
    both = {
        "": ({}, {}),
        "brush_drop": (brush(), {}),
        "current_offset": ({}, dict(current_offset=peak * draw(0.01, 0.03))),
        "voltage_offset": ({}, dict(voltage_offset=m["R"] * peak * draw(0.05, 0.15))),
        "channel_delay": ({}, dict(delay=draw(6e-5, 3e-4))),
        "speed_lag": ({}, dict(lag=draw(4e-3, 2e-2))),
        "adc_clipping": ({}, dict(clip=peak * draw(0.6, 0.85))),
        "stribeck": (dict(stribeck=m["mu0"] * draw(1, 3), stribeck_speed=top * draw(0.03, 0.1)), {}),
        "bearing_warmup": (dict(warm=draw(0.7, 2)), {}),
        "commutation_demagnetisation": (dict(demagnetisation=draw(0.04, 0.1), nominal=top), {}),
    }
    if not m["universal"]:
        return both | {
            "supply_dead_zone": (dict(dead_zone=12 * draw(0.03, 0.08)), {}),
            "quadratic_load": (dict(mu2=0.3 * torque / top**2), {}),
            "torque_offset": (dict(torque=0.4 * m["mu0"]), {}),
            "asymmetric_friction": (dict(asymmetry=0.4), {}),
        }
    return both | {
        "saturation": (knee(0.6, 1.5, int(random.integers(3))) | dict(linked=linked()), {}),
        "inductance_saturation": (dict(inductance_knee=0.6 * peak, inductance_lost=draw(0.25, 0.6)), {}),
        "hysteresis": (dict(lag_current=peak * draw(0.02, 0.05), linked=linked()), {}),
        "eddy_current": (dict(eddy=draw(5e-5, 2e-4), linked=linked()), {}),
        "remanence": (dict(remanence=peak * draw(0.01, 0.03)), {}),
        "current_compression": ({}, dict(compression=peak * draw(1.5, 3))),
        "windage_exponent": (dict(exponent=float(random.choice([1.6, 2.5, 2.8])), exponent_speed=0.8 * top), {}),
        "iron_loss_drag": (dict(iron=0.08 * torque / (peak * peak / 2 * top)), {}),
        "winding_temperature": (dict(heat=0.25 / (peak * peak)), {}),
        "saturation hysteresis": (knee(0.7, 1.3, 0) | dict(lag_current=peak * draw(0.02, 0.05)), {}),
        "saturation brush_drop": (knee(0.7, 1.3, 0) | brush(), {}),
        "saturation channel_delay": (knee(0.7, 1.3, 0), dict(delay=1e-4)),
    }


def foreign(motor, random):
    """The same of what the catalogue lacks."""
    _, _, peak, top = SUPPLY[motor]
    m = MOTORS[motor]
    torque = m["K"] * (peak * peak / 2 if m["universal"] else peak)
    drop = dict(brush=m["R"] * peak * 0.12, brush_width=0.03 * peak)
    when = lambda: float(random.uniform(0.35, 0.65))
    factor = lambda size: float(1 + random.choice([-1, 1]) * random.uniform(0.7, 1.3) * size)
    return {
        "another J": (dict(change=when(), other_J=factor(0.3)), {}),
        "another R": (dict(change=when(), other_R=factor(0.15)), {}),
        "another K": (dict(change=when(), other_K=factor(0.05)), {}),
        "another mu0": (dict(change=when(), other_mu0=factor(0.6)), {}),
        "drop with speed": (drop | dict(brush_speed=float(random.uniform(1, 3)), nominal=top), {}),
        "cam": (dict(cam=torque * float(random.uniform(0.05, 0.15))), {}),
        "lost samples": ({}, dict(lost=(when(), float(random.uniform(0.004, 0.02))))),
        "clock of the speed": ({}, dict(clock=float(random.choice([-1, 1]) * random.uniform(2e-4, 1e-3)))),
    }


def judge(case):
    greyrig, motor, truth, kinds, rate, seed, effect, chain, noise, folder = case
    names = []
    for place, kind in enumerate(kinds):
        # What has changed in the first recording stays so.
        effect = effect | (dict(change=1e-9) if place > 0 and "change" in effect else {})
        path = folder / f"{seed}-{kind}.csv"
        record(path, motor, kind, rate, seed, effect, chain, noise)
        names.append(str(path))
    motor_kind = "universal" if MOTORS[motor]["universal"] else "pm-dc"
    done = subprocess.run([greyrig, "diagnose", "--json", "--kind", motor_kind, *names], capture_output=True, text=True)
    for name in names:
        Path(name).unlink()
    if done.returncode != 0:
        return case, "error", [], done.stderr.strip().splitlines()[-1:], None, set()
    answer = json.loads(done.stdout)
    codes = {finding["code"] for finding in answer["data_findings"]}
    return case, answer["verdict"]["kind"], answer["verdict"]["effects"], answer["classes"], told(answer), codes


def told(answer):
    """What is told beside a verdict, and how far off the model is: its errors over the noise floor."""
    floor = (answer["noise_floor"] or {}).values()
    over = [a / b for a, b in zip(answer["esr_after"].values(), floor) if a and b]
    besides = [answer["remaining"]["cause"]] if answer["remaining"] else []
    besides += [f["code"] for f in answer["data_findings"] if f["severity"] != "info"]
    return f"{max(over, default=0):.1f} times the floor {' '.join(besides)}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("greyrig", help="the program")
    parser.add_argument("--seed", type=int, default=1, help="what is drawn")
    parser.add_argument("--rounds", type=int, default=1, help="cases of each motor and effect")
    parser.add_argument("--noise", type=float, default=1.0, help="factor on the noise")
    parser.add_argument("--foreign", action="store_true", help="what the catalogue lacks")
    parser.add_argument("--jobs", type=int, default=2, help="cases at a time")
    args = parser.parse_args()
    random = np.random.default_rng(args.seed)
    figures = {"right": 0, "ambiguous, with the truth": 0, "outside the catalogue": 0, "nothing named": 0, "a wrong name": 0, "error": 0}
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(args.jobs) as pool:
        cases = []
        for _ in range(args.rounds):
            for motor in MOTORS:
                for truth, (effect, chain) in (foreign if args.foreign else effects)(motor, random).items():
                    sets = SETS[MOTORS[motor]["universal"]]
                    kinds, rate = sets[random.integers(len(sets))], int(random.choice([10000, 10000, 5000, 20000]))
                    seed = int(random.integers(1, 10**6))
                    cases.append((args.greyrig, motor, truth, kinds, rate, seed, effect, chain, args.noise, Path(folder)))
        for case, kind, named, classes, besides, codes in pool.map(judge, cases):
            _, motor, truth, kinds, rate, *_ = case
            # That a channel clips is a finding about the recording; the motor lacks nothing.
            wanted = set() if truth == "adc_clipping" and "clipped" in codes else set(truth.split())
            if args.foreign:
                kinds_told = {"missing_effect": "a wrong name", "ambiguous": "a wrong name", "none": "nothing named",
                              "outside_catalogue": "outside the catalogue", "insufficient_data": "insufficient", "error": "error"}
                figure = kinds_told[kind]
                # The law that it has, and that it has another form; a torque that goes with the angle, a few times a turn.
                if truth == "drop with speed" and named == ["brush_drop"] and "form_of_law" in besides:
                    figure = "right"
                if truth == "cam" and kind == "missing_effect" and set(named) <= {"torque_ripple", "imbalance", "position_load"}:
                    figure = "right"
                if truth.startswith("another ") and named == ["parameter_step"]:
                    figure = "right"
                figures[figure] = figures.get(figure, 0) + 1
                print(f"{motor}, {truth}, {'+'.join(kinds)} at {rate} Hz: {figure} {' '.join(named)}; {besides}", flush=True)
                continue
            members = [set(next((c for c in classes if n in c), [n])) for n in named] if kind != "error" else []
            covered = all(any(t in m for m in members) for t in wanted)
            if kind == "error":
                figure = "error"
            elif kind in ("missing_effect", "none") and covered and len(named) == len(wanted):
                figure = "right"
            elif kind == "ambiguous" and covered:
                figure = "ambiguous, with the truth"
            elif kind == "outside_catalogue":
                figure = "outside the catalogue"
            elif not named:
                figure = "nothing named"
            else:
                figure = "a wrong name"
            figures[figure] += 1
            if figure != "right":
                print(f"{motor}, {truth or 'healthy'}, {'+'.join(kinds)} at {rate} Hz: {figure} {' '.join(named)}", flush=True)
    print(f"\n{sum(figures.values())} cases: " + ", ".join(f"{name} {count}" for name, count in figures.items()))


if __name__ == "__main__":
    main()
