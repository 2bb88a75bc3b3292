"""The loop, end to end: each answer is that of the command, bit by bit."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import greyrig
import pytest
from conftest import Command


def test_identify(command: Command, tmp_path: Path) -> None:
    said = command("identify", "steps.csv", "ramp.csv", "--fix", "J=2e-5", "--effect", "brush_drop", "--json")
    found = greyrig.identify(["steps.csv", "ramp.csv"], fix={"J": 2e-5}, effects="brush_drop")
    assert found.to_json() == said.out.strip()
    assert found.to_dict() == said.json
    assert found["J"].status == "fixed" and found["J"].value == 2e-5
    assert found["K"].ci95 is not None and found["K"].ci95[0] < (found["K"].value or 0.0) < found["K"].ci95[1]
    assert found.esr is not None and found.esr.current == said.json["esr"]["current"]
    assert found.model.effects == ["brush_drop"]


def test_the_model_file_is_the_same(command: Command, here: Path, tmp_path: Path) -> None:
    assert command("identify", "steps.csv", "--out", str(tmp_path / "one.toml")).code == 0
    found = greyrig.identify("steps.csv", out=tmp_path / "other.toml")
    assert (tmp_path / "one.toml").read_bytes() == (tmp_path / "other.toml").read_bytes()
    assert found.to_dict()["model"] == str(tmp_path / "other.toml")
    assert greyrig.load_model(tmp_path / "one.toml") == found.model
    assert found.model.to_toml() == (tmp_path / "one.toml").read_text()


def test_compare(command: Command, tmp_path: Path) -> None:
    out = str(tmp_path / "series.csv")
    said = command("compare", "ramp.csv", "again.csv", "--model", "model.toml", "--out", out, "--json")
    against = greyrig.compare(["ramp.csv", "again.csv"], "model.toml", out=out, force=True)
    assert against.to_json() == said.out.strip()
    assert [region.text for region in against.where] == [region["text"] for region in said.json["where"]]
    series = against.series()
    # The residual is what the figures say: modelled less measured.
    error = series["modelled_i_a"] - series["measured_i_a"]
    assert (error == series["residual_i_a"]).all()
    assert set(series.words("recording")) == {"ramp.csv", "again.csv"}
    assert len(Path(out).read_text().splitlines()) > len(series)


def test_diagnose(command: Command) -> None:
    said = command("diagnose", "steps.csv", "ramp.csv", "--model", "model.toml", "--json")
    what = greyrig.diagnose(["steps.csv", "ramp.csv"], "model.toml")
    assert what.to_json() == said.out.strip()
    assert what.verdict.kind == "missing_effect" and what.effects[0] == "brush_drop"
    assert what.next_command is not None and what.next_command.startswith("greyrig add brush_drop")


def test_diagnose_without_a_model(command: Command) -> None:
    said = command("diagnose", "steps.csv", "--kind", "pm-dc", "--exclude", "brush_drop", "--json")
    what = greyrig.diagnose(greyrig.load("steps.csv"), kind="pm-dc", exclude=["brush_drop"])
    assert what.to_json() == said.out.strip()
    assert all(candidate.effect != "brush_drop" for candidate in what.candidates)


def test_add(command: Command) -> None:
    said = command("add", "brush_drop", "--model", "model.toml", "steps.csv", "ramp.csv", "--json")
    better = greyrig.add("brush_drop", ["steps.csv", "ramp.csv"], greyrig.load_model("model.toml"))
    assert better.to_json() == said.out.strip()
    assert better.accepted and better.model.effects == ["brush_drop"]
    before, after = better.held_out_before.current, better.held_out_after.current
    assert before is not None and after is not None and after < before


def test_a_term_of_ones_own(command: Command) -> None:
    term = "k*i*abs(i)"
    said = command("add", "--term", term, "--model", "model.toml", "steps.csv", "ramp.csv", "--json")
    assert greyrig.add([], ["steps.csv", "ramp.csv"], "model.toml", terms=term).to_json() == said.out.strip()


def test_predict(command: Command, tmp_path: Path) -> None:
    out = str(tmp_path / "run.csv")
    said = command("predict", "ramp.csv", "--model", "model.toml", "--out", out, "--band", "95", "--json")
    run = greyrig.predict("ramp.csv", "model.toml", band=95, out=out, force=True)
    assert run.to_json() == said.out.strip()
    series, end = run.series(), run.end
    assert end is not None and series["i_a"][-1] == end.i_a.value
    assert end.i_a.band == (series["i_a_lo"][-1], series["i_a_hi"][-1])
    # What was written is what is held: the numbers come back from their text.
    again = greyrig.load(out)
    assert (again["i_a"] == series["i_a"]).all() and (again["omega_rad_s"] == series["omega_rad_s"]).all()


def test_from_recording_to_prediction(here: Path) -> None:
    """Nothing on the disk but the recordings."""
    first = greyrig.identify("steps.csv")
    what = greyrig.diagnose("steps.csv", first.model)
    assert what.next_command is None, "no command line can name a model that is in no file"
    better = greyrig.add(what.effects, ["steps.csv", "ramp.csv"], first.model)
    assert better.accepted
    ramp = greyrig.load("ramp.csv")
    voltage = greyrig.recording({"t_s": ramp["t_s"], "u_v": ramp["u_v"]}, metadata={"motor": "pm-dc"})
    run = greyrig.predict(voltage, better.model)
    measured, predicted = ramp["omega_rad_s"], run.series()["omega_rad_s"]
    error = ((predicted - measured) ** 2).mean() ** 0.5 / (measured**2).mean() ** 0.5
    # Noise of the sensor and of the load, and no more: the speed's floor of these recordings is below 1 %.
    assert error < 0.02


def test_answers_do_not_change(here: Path) -> None:
    found = greyrig.identify("steps.csv", method="least-squares")
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.kind = "universal"  # pyright: ignore[reportAttributeAccessIssue]


def test_in_a_notebook(here: Path, tmp_path: Path) -> None:
    against = greyrig.compare("ramp.csv", "model.toml")
    shown = against._repr_html_()
    assert shown.count("<iframe") == 1 and "sandbox" in shown
    page = against.report()
    assert page is not None and page.startswith("<!DOCTYPE html>")
    assert not re.search(r"""(src|href)=["']?(https?:)?//""", page), "it needs no network"
    against.save_report(tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text() == page
    with pytest.raises(greyrig.UsageError, match="--force"):
        against.save_report(tmp_path / "report.html")
