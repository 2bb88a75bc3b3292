#!/usr/bin/env python3
"""A unit of `greyrig export`, held against the standard and against greyrig itself by FMPy, which knows nothing of it.

    cargo build --release -p greyrig-host -p greyrig-fmi
    python3 -m venv fmpy && fmpy/bin/pip install fmpy
    fmpy/bin/python host-tools/benches/fmu_check.py target/release/greyrig [--model MODEL.toml]

Where ecospy (with tbb) and libcosimpy are installed as well, these simulators load the unit, too. Where SciPy is, it
integrates the equations of the Modelica text, if the model has one.

For FMI 3.0 and 2.0: FMPy finds no problem in the description; a simulation along a held voltage has the bits of
`greyrig predict --input held`; several instances at once do not disturb each other; a state can be gone back to; a wrong
step and a wrong token are refused with a message. Exit code 0: all hold.
"""

import argparse
import csv
import math
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np
from fmpy import extract, instantiate_fmu, read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

INTERVAL = 1e-4
SAMPLES = 10_000

MODEL = """\
schema = 1
kind = "universal"
base = "full"
motor = "VC-1400"
[parameters]
R = { value = 2.2, unit = "ohm" }
L = { value = 0.02, unit = "H" }
K = { value = 9.45e-3, unit = "V s/(rad A)" }
J = { value = 1.8e-4, unit = "kg m2" }
mu0 = { value = 0.015, unit = "N m" }
mu1 = { value = 8e-6, unit = "N m s/rad" }
mu2 = { value = 2.98e-8, unit = "N m s2/rad2" }
[[effects]]
id = "brush_drop"
[effects.parameters]
brush_drop = { value = 2.5, unit = "V" }
brush_transition = { value = 0.3, unit = "A" }
"""


def voltage():
    """An AC voltage with jumps of its amplitude, V."""
    t = np.arange(SAMPLES) * INTERVAL
    return t, np.where(t < 0.5, 100.0, 230.0) * np.sin(2 * math.pi * 50 * t)


def run(greyrig, *arguments):
    done = subprocess.run([greyrig, *arguments], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, arguments))}: {done.stderr.strip()}")
    return done.stdout


def predicted(greyrig, model, folder):
    """Current and speed along the held voltage as greyrig itself has them; none if it cannot yet."""
    t, u = voltage()
    drive, series = folder / "drive.csv", folder / "series.csv"
    with open(drive, "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["t_s", "u_v"])
        rows.writerows((repr(float(a)), repr(float(b))) for a, b in zip(t, u))
    if subprocess.run([greyrig, "predict", "--help"], capture_output=True).returncode:
        return None
    run(greyrig, "predict", "--model", model, drive, "--out", series, "--input", "held", "--force")
    with open(series, newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return [np.array([float(row[name]) for row in rows]) for name in ("i_a", "omega_rad_s")]


class Stepped:
    """An instance that is called step by step."""

    def __init__(self, unit, description):
        self.is_three = description.fmiVersion.startswith("3")
        self.fmu = instantiate_fmu(extract(unit), description, "CoSimulation")
        self.numbers = {v.name: v.valueReference for v in description.modelVariables}
        self.time = 0.0
        if self.is_three:
            self.fmu.enterInitializationMode()
        else:
            self.fmu.setupExperiment(startTime=0.0)
            self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def set(self, name, value):
        (self.fmu.setFloat64 if self.is_three else self.fmu.setReal)([self.numbers[name]], [value])

    def get(self, *names):
        return (self.fmu.getFloat64 if self.is_three else self.fmu.getReal)([self.numbers[n] for n in names])

    def step(self, length=INTERVAL):
        self.fmu.doStep(currentCommunicationPoint=self.time, communicationStepSize=length)
        self.time += length

    def state(self, what, *given):
        """Calls the function `getFMUState` and its kin, which the older version spells otherwise."""
        return getattr(self.fmu, what + ("FMUState" if self.is_three else "FMUstate"))(*given)

    def end(self):
        self.fmu.terminate()
        self.fmu.freeInstance()


STEADY = 100.0
STEPS = 3_000


def by_fmpy(unit, description):
    """Current and speed after so many steps on a steady voltage."""
    stepped = Stepped(unit, description)
    stepped.set("u_v", STEADY)
    for _ in range(STEPS):
        stepped.step()
    found = list(stepped.get("i_a", "omega_rad_s"))
    stepped.end()
    return found


def by_ecos(unit, _):
    """The same by ECOS, whose importer is fmi4c."""
    from ecospy import EcosSimulation, EcosSimulationStructure

    with EcosSimulationStructure() as structure:
        structure.add_model("one", unit)
        with EcosSimulation(structure=structure, step_size=INTERVAL) as simulation:
            simulation.init()
            simulation.set_real("one::u_v", STEADY)
            simulation.step(STEPS)
            return [simulation.get_real(f"one::{name}") for name in ("i_a", "omega_rad_s")]


def by_libcosim(unit, description):
    """The same by libcosim, whose importer is the FMI Library; none for FMI 3.0."""
    if description.fmiVersion.startswith("3"):
        return None
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(step_size=round(INTERVAL * 1e9))
    slave = execution.add_local_slave(local_slave=CosimLocalSlave(fmu_path=unit, instance_name="one"))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    numbers = {v.name: v.valueReference for v in description.modelVariables}
    execution.real_initial_value(slave_index=slave, variable_reference=numbers["u_v"], value=STEADY)
    execution.step(STEPS)
    wanted = [numbers["i_a"], numbers["omega_rad_s"]]
    return list(observer.last_real_values(slave_index=slave, variable_references=wanted))


def by_equations(text, u):
    """Current and speed at each sample, by integrating the equations of a Modelica class along a held voltage."""
    from scipy.integrate import solve_ivp

    head, body = text.split("\nequation\n")
    known = {"abs": abs, "sign": lambda x: float(np.sign(x)), "exp": math.exp, "sqrt": math.sqrt, "tanh": math.tanh}
    parameter = r'parameter Real (\w+)(?:\(unit = "[^"]*"\))? = (\S+)'
    known |= {name: float(value) for name, value in re.findall(parameter, head)}

    def python(formula):
        cases = r"noEvent\(if (.+?) then (.+?) else (.+)\)$"
        return compile(re.sub(cases, r"((\2) if \1 else (\3))", formula).replace("^", "**"), formula, "eval")

    lines = [line.strip() for line in body.replace("\n    ", " ").split(";\n")]
    sides = [line.split(" = ", 1) for line in lines if " = " in line]
    equations = [(left, python(right)) for left, right in sides]

    def slopes(_, state, voltage):
        values = known | {"i": state[0], "omega": state[1], "u": voltage, "load": 0.0}
        for left, right in equations:
            values[left] = eval(right, {"__builtins__": {}}, values)
        return [values["inductance*der(i)"] / values["inductance"], values["J*der(omega)"] / values["J"]]

    states = [np.zeros(2)]
    for voltage in u[:-1]:
        done = solve_ivp(slopes, (0.0, INTERVAL), states[-1], args=(float(voltage),), rtol=1e-8, atol=1e-9)
        states.append(done.y[:, -1])
    return np.array(states).T


def check_modelica(greyrig, model, folder, by_steps):
    """Whether the equations of the text give what the unit gives; a line if not."""
    out = folder / "motor.mo"
    done = subprocess.run([greyrig, "export", "--model", model, "--modelica", out], capture_output=True, text=True)
    if done.returncode:
        print(f"Modelica: {done.stderr.strip()}")
        return []
    samples = 2_000
    try:
        own = by_equations(out.read_text(), voltage()[1][:samples])
    except ImportError:
        print("Modelica: SciPy is not installed")
        return []
    off = [np.abs(a - b[:samples]).max() / np.abs(a).max() for a, b in zip(own, by_steps)]
    # The unit's step is off by hundredths of a per mille of an AC current (README), in single precision.
    holds = max(off) < 2e-4
    print(f"Modelica: the unit, off by {off[0]:.1e} (current), {off[1]:.1e} (speed): {'ok' if holds else 'FAILED'}")
    return [] if holds else ["Modelica: other numbers than the unit"]


def check(greyrig, model, version, folder):
    """What does not hold, a line each, and what was found."""
    unit = folder / f"motor{version}.fmu"
    run(greyrig, "export", "--model", model, "--fmu", unit, "--fmi", version)
    faults = [f"FMI {version}: {problem}" for problem in validate_fmu(str(unit))]
    description = read_model_description(str(unit))

    def expect(holds, what):
        print(f"FMI {description.fmiVersion}: {what}: {'ok' if holds else 'FAILED'}")
        if not holds:
            faults.append(f"FMI {version}: {what}")

    expect(not faults, "the description has no problem")
    t, u = voltage()
    signals = np.zeros(len(t), dtype=[("time", float), ("u_v", float)])
    signals["time"], signals["u_v"] = t, u
    result = simulate_fmu(
        str(unit), stop_time=t[-1], step_size=INTERVAL, output_interval=INTERVAL, input=signals,
        output=["i_a", "omega_rad_s"], fmi_type="CoSimulation", validate=True,
    )
    own = [result["i_a"], result["omega_rad_s"]]
    expect(len(result) == len(t) and own[1].max() > 10.0, f"FMPy simulates it to {own[1].max():.1f} rad/s")

    # Read after each step, as FMPy does, and again with the next voltage set, which a learned correction knows at once.
    stepped = Stepped(str(unit), description)
    other = Stepped(str(unit), description)
    stepped.set("u_v", float(u[0]))
    other.set("u_v", -float(u[0]))
    after, at = ([stepped.get("i_a", "omega_rad_s")] for _ in range(2))
    for n in range(1, len(t)):
        stepped.step()
        other.step()
        after.append(stepped.get("i_a", "omega_rad_s"))
        stepped.set("u_v", float(u[n]))
        other.set("u_v", -float(u[n]))
        at.append(stepped.get("i_a", "omega_rad_s"))
    by_steps, at = np.array(after).T, np.array(at).T
    # FMPy's clock is a sum, at which it looks its input up between the samples.
    off = max(np.abs(a[1:] - b[1:]).max() / np.abs(b).max() for a, b in zip(own, by_steps))
    expect(off < 1e-6, f"simulated as stepped, off by {off:.1e} of the largest value")
    known = predicted(greyrig, model, folder)
    if known is None:
        print(f"FMI {description.fmiVersion}: this greyrig has no command predict; its bits are not compared")
    else:
        same = all(np.array_equal(a.astype(np.float32), b.astype(np.float32)) for a, b in zip(at, known))
        expect(same, f"the bits of greyrig predict, {len(t)} samples")

    steady = by_fmpy(str(unit), description)
    for name, other_simulator in (("ECOS", by_ecos), ("libcosim", by_libcosim)):
        try:
            found = other_simulator(str(unit), description)
        except (ImportError, OSError):
            print(f"FMI {description.fmiVersion}: {name} is not installed")
            continue
        if found is not None:
            expect(found == steady, f"{name} has the bits of FMPy after {STEPS} steps, {found[1]:.1f} rad/s")

    state = stepped.state("get")
    def further():
        rows = []
        for n in range(50):
            stepped.set("u_v", float(u[n]))
            stepped.step()
            rows.append(stepped.get("i_a", "omega_rad_s"))
        return rows
    begin = stepped.time
    first = further()
    stepped.state("set", state)
    stepped.time = begin
    expect(first == further(), "a state can be gone back to")
    stepped.state("free", state)
    try:
        stepped.fmu.doStep(currentCommunicationPoint=stepped.time, communicationStepSize=-1.0)
        expect(False, "a wrong step is refused")
    except Exception:
        expect(True, "a wrong step is refused")
    stepped.end()
    other.end()
    description.guid = "{another}"
    try:
        instantiate_fmu(extract(str(unit)), description, "CoSimulation")
        expect(False, "a wrong token is refused")
    except Exception:
        expect(True, "a wrong token is refused")
    return faults, by_steps


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("greyrig", type=pathlib.Path)
    parser.add_argument("--model", type=pathlib.Path, help="a model; a universal motor with a brush drop unless given")
    given = parser.parse_args()
    greyrig = given.greyrig.resolve()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        model = given.model.resolve() if given.model else folder / "model.toml"
        if not given.model:
            model.write_text(MODEL)
        faults, runs = [], []
        for version in ("3", "2"):
            more, by_steps = check(greyrig, model, version, folder)
            faults += more
            runs.append(by_steps)
        faults += check_modelica(greyrig, model, folder, runs[0])
        if not np.array_equal(*runs):
            faults.append("the two versions differ")
        print(f"both versions, to the bit: {'ok' if np.array_equal(*runs) else 'FAILED'}")
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
