"""From healthy motors to verdicts, and what stands around the loop: check, simulate, train."""

from __future__ import annotations

from pathlib import Path

import greyrig
import pytest
from conftest import Command

HEALTHY = 6


@pytest.fixture
def lot(command: Command, here: Path) -> list[str]:
    """Healthy motors of a lot, and two that are to be judged."""
    names = [f"healthy-{seed}.csv" for seed in range(HEALTHY)]
    start = ["simulate", "--kind", "pm-dc", "--profile", "start", "--spread", "0.02", "--seconds", "3"]
    for seed, name in enumerate(names):
        if not Path(name).exists():
            assert command(*start, "--seed", str(seed), "--out", name).code == 0
    for name, seed, fault in [("good.csv", "21", []), ("bad.csv", "22", ["--fault", "resistance_up=0.3@1.5"])]:
        if not Path(name).exists():
            assert command(*start, "--seed", seed, *fault, "--out", name).code == 0
    if not Path("plain.toml").exists():
        assert command("simulate", "--kind", "pm-dc", "--seconds", "6", "--seed", "9", "--out", "plain.csv").code == 0
        assert command("identify", "plain.csv", "--out", "plain.toml").code == 0
    return names


def test_calibrate_and_monitor(command: Command, lot: list[str], tmp_path: Path) -> None:
    one, other = str(tmp_path / "one.toml"), tmp_path / "other.toml"
    said = command("calibrate", *lot, "--model", "plain.toml", "--out", one, "--json")
    limits = greyrig.calibrate(lot, "plain.toml")
    expected = said.json | {"model": None}
    assert limits.to_dict() == expected and limits.detector.motors == HEALTHY
    assert limits.model.save(other).to_toml() == Path(one).read_text()

    said = command("monitor", "good.csv", "bad.csv", "--model", one, "--json")
    judged = greyrig.monitor(["good.csv", "bad.csv"], one)
    assert judged.to_json() == said.out.strip() and said.code == 1
    assert [run.verdict for run in judged.runs] == ["pass", "fail"] and judged.verdict == "fail"
    assert judged.runs[1].alarms[0].kind == "electrical" and judged.runs[1].alarms[0].t_s > 1.5
    assert "<iframe" in judged._repr_html_()
    # With a model in memory only its name is another.
    assert greyrig.monitor("good.csv", limits.model).runs == judged.runs[:1]


def test_a_motor_by_its_number(command: Command, lot: list[str], tmp_path: Path) -> None:
    station = greyrig.calibrate(lot, "plain.toml", out=tmp_path / "station.toml").model
    told = greyrig.monitor("good.csv", station, serial="17", temp_c=25.0)
    said = command("monitor", "good.csv", "--model", str(station.path), "--serial", "17", "--temp-c", "25", "--json")
    assert told.to_json() == said.out.strip() and told.runs[0].serial == "17"
    with pytest.raises(greyrig.UsageError, match="one motor's"):
        greyrig.monitor(["good.csv", "bad.csv"], station, serial="17")
    with pytest.raises(greyrig.UsageError, match="motor type"):
        greyrig.monitor("good.csv", station, motor="of another type")
    with pytest.raises(greyrig.UsageError, match="no limits of the detector"):
        greyrig.monitor("good.csv", "plain.toml")


def test_check(command: Command, here: Path) -> None:
    rows = "\n".join(f"{n * 1e-3:.3f},{min(n % 70, 50)},{n % 7},300" for n in range(3000))
    Path("clipped.csv").write_text(f"t_s,u_v,i_a,omega_rad_s\n{rows}\n")
    for name in ["steps.csv", "clipped.csv"]:
        said = command("check", name, "--json")
        found = greyrig.check(name)
        assert found.to_json() == said.out.strip()
        assert found.is_usable == (said.code == 0)
    assert greyrig.check("clipped.csv").data_findings


def test_simulate(command: Command, tmp_path: Path) -> None:
    out = str(tmp_path / "run.parquet")
    options = ["--effect", "saturation=0.3", "--profile", "ramp", "--seconds", "2", "--seed", "4", "--rate", "5000"]
    assert command("simulate", *options, "--out", out).code == 0
    of_file = greyrig.load(out)
    made = greyrig.simulate(effects="saturation=0.3", profile="ramp", seconds=2, seed=4, rate_hz=5000)
    assert len(made) == len(of_file) == 10_000 and made.name == "simulated"
    assert all((made[name] == of_file[name]).all() for name in of_file.columns)
    said = command("simulate", "--effect", "saturation=7", "--out", str(tmp_path / "not.csv"))
    with pytest.raises(greyrig.UsageError) as caught:
        greyrig.simulate(effects="saturation=7")
    assert f"greyrig: {caught.value}" in said.err


def test_train(command: Command, tmp_path: Path) -> None:
    one, other = str(tmp_path / "one.toml"), str(tmp_path / "other.toml")
    few = ["--epochs", "2", "--bell", "1"]
    said = command("train", "steps.csv", "ramp.csv", "--model", "model.toml", *few, "--out", one, "--json")
    learnt = greyrig.train(["steps.csv", "ramp.csv"], "model.toml", epochs=2, bell=1, out=other)
    assert learnt.to_dict() | {"model": one} == said.json
    assert Path(one).read_bytes() == Path(other).read_bytes()
    assert len(learnt.epochs) == len(said.json["epochs"]) and "correction" in learnt.model.to_dict()
    with pytest.raises(greyrig.UsageError, match="delay"):
        greyrig.train("steps.csv", "model.toml", delay_s=7.0)
