"""What is answered: frozen dataclasses. ``to_dict()`` is the JSON object that the command prints."""

from __future__ import annotations

import html
import json
import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from . import _native
from ._decode import decode

if TYPE_CHECKING:
    from ._model import Model
    from ._table import Table

T = TypeVar("T", bound="Result")


@dataclass(frozen=True, kw_only=True)
class PerSignal:
    """A figure for each signal; ``None`` where it does not apply."""

    current: float | None = None
    speed: float | None = None
    torque: float | None = None


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A parameter in SI units."""

    name: str
    value: float | None
    """``None``: the recordings do not tell it, and nobody gave it."""
    unit: str
    ci95: tuple[float, float] | None
    """95 % interval."""
    identifiable: bool
    status: str
    """``identified``, ``fixed`` or ``not_identifiable``."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """Something that is wrong with a recording."""

    code: str
    severity: str
    """``info``, ``warning`` or ``stop``."""
    recording: str
    channel: str | None
    from_s: float | None
    to_s: float | None
    value: float | None
    unit: str | None
    handled: str
    """``none``, ``masked``, ``modelled``, ``split``, ``corrected`` or ``refused``."""
    text: str
    remedy: str | None
    """The option that mends it."""


@dataclass(frozen=True, kw_only=True)
class Region:
    """Where a model fails."""

    axis: str
    quantity: str
    error_rms: float
    """In the unit of the quantity."""
    times_average: float
    share: float
    """Share of the squared error."""
    text: str
    low: float = field(metadata={"json": "from"})
    high: float = field(metadata={"json": "to"})


@dataclass(frozen=True, kw_only=True)
class RecordingComparison:
    """A model against one recording."""

    recording: str
    esr: PerSignal
    noise_floor: PerSignal
    rms: PerSignal
    cutoff_hz: float
    diverges: bool


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """An effect that was tried."""

    effect: str
    esr_after: PerSignal
    held_out_gain: float
    """By how much the error on data held out falls: 0.9 is 90 %."""
    confused_with: tuple[str, ...]
    objection: str | None
    """Why it does not count; ``None``: it does."""
    step: int
    probability: float | None = None


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Which effect is missing."""

    kind: str
    """``missing_effect``, ``none``, ``ambiguous``, ``outside_catalogue`` or ``insufficient_data``."""
    effects: tuple[str, ...]
    """In the order in which they should be added."""
    text: str
    next_experiment: str | None
    probability: float | None = None


@dataclass(frozen=True, kw_only=True)
class Predicted:
    """A predicted value."""

    value: float
    band: tuple[float, float] | None


@dataclass(frozen=True, kw_only=True)
class End:
    """Where a prediction ends."""

    t_s: float
    i_a: Predicted
    omega_rad_s: Predicted


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """Where a prediction leaves what the fit has seen."""

    quantity: str
    from_s: float
    to_s: float
    beyond: float
    seen: tuple[float, float]


def _percent(ratio: float | None) -> str:
    return "–" if ratio is None else f"{100 * ratio:.3g} %"


def _both(ratios: PerSignal | None) -> str:
    if ratios is None:
        return "unknown"
    named = {"current": ratios.current, "speed": ratios.speed, "torque": ratios.torque}
    return ", ".join(f"{name} {_percent(x)}" for name, x in named.items() if x is not None) or "–"


@dataclass(frozen=True, kw_only=True, repr=False)
class Result:
    """What all answers share."""

    schema: int
    command: str
    recordings: tuple[str, ...]
    data_findings: tuple[Finding, ...] = ()
    _native: _native.Answer = field(init=False, repr=False, compare=False)

    def to_dict(self) -> dict[str, Any]:
        """The JSON object of the interface, as ``greyrig … --json`` prints it."""
        return json.loads(self.to_json())

    def to_json(self) -> str:
        """The same as text, byte by byte."""
        return self._native.json

    def report(self) -> str | None:
        """The report, an HTML page that needs no network; ``None`` where there is nothing to show."""
        return self._native.report()

    def save_report(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Writes the report; an existing file is replaced with ``force`` alone."""
        page = self.report()
        if page is None:
            raise ValueError("there is nothing to report")
        _native.write_text(os.fspath(path), page, force)

    def _summary(self) -> list[str]:
        return []

    def __str__(self) -> str:
        return "\n".join(self._summary())

    def __repr__(self) -> str:
        return f"<greyrig.{type(self).__name__}>\n{self}"

    def _repr_html_(self) -> str:
        told = f"<pre>{html.escape(str(self))}</pre>"
        page = self.report()
        if page is None:
            return told
        # Within a frame of its own, the page's style and scripts reach nothing of the notebook, and nothing of it needs
        # a network.
        frame = 'width="100%" height="620" style="border:1px solid #8884" sandbox="allow-scripts"'
        return f'{told}<iframe {frame} srcdoc="{html.escape(page)}"></iframe>'


def result(cls: type[T], native: _native.Answer) -> T:
    """An answer of the native side."""
    made = decode(cls, json.loads(native.json))
    object.__setattr__(made, "_native", native)
    return made


class _WithModel:
    _native: _native.Answer

    @property
    def model(self) -> Model:
        """The model that came of it."""
        from ._model import Model

        model = self._native.model
        assert model is not None
        return Model(model)


class _WithParameters:
    parameters: tuple[Parameter, ...]

    def __getitem__(self, name: str) -> Parameter:
        """A parameter by its name."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(name)


def _rows(parameters: tuple[Parameter, ...]) -> list[str]:
    def row(p: Parameter) -> str:
        value = "–" if p.value is None else f"{p.value:.5g}"
        interval = "" if p.ci95 is None else f"{p.ci95[0]:.5g} … {p.ci95[1]:.5g}"
        status = "" if p.status == "identified" else p.status.replace("_", " ")
        return f"{p.name:12} {value:>12}  {p.unit:18} {interval:26} {status}".rstrip()

    return [row(p) for p in parameters]


@dataclass(frozen=True, kw_only=True, repr=False)
class Identification(_WithParameters, _WithModel, Result):
    """Parameters of a motor type, and how far the model is off."""

    kind: str
    parameters: tuple[Parameter, ...]
    esr: PerSignal | None
    """Free-run error-to-signal ratio."""
    noise_floor: PerSignal | None
    """What a perfect model would show on these data."""
    noise_floor_source: str | None
    notes: tuple[str, ...]

    def _summary(self) -> list[str]:
        errors = f"error: {_both(self.esr)}; noise floor: {_both(self.noise_floor)}"
        return [*_rows(self.parameters), *(f"note: {note}" for note in self.notes), errors]


class _WithSeries:
    _native: _native.Answer

    def series(self) -> Table:
        """Sample by sample, as the command writes it with ``--out``."""
        from ._table import Table

        table = self._native.series()
        assert table is not None
        return Table(table)


@dataclass(frozen=True, kw_only=True, repr=False)
class Comparison(_WithSeries, Result):
    """A model against measurements, and where it fails."""

    esr: PerSignal
    noise_floor: PerSignal
    noise_floor_source: str | None
    structured: PerSignal
    one_step: PerSignal
    diverges: bool
    per_recording: tuple[RecordingComparison, ...]
    where: tuple[Region, ...]
    """Worst first."""

    def _summary(self) -> list[str]:
        errors = f"error: {_both(self.esr)}; noise floor: {_both(self.noise_floor)}"
        return [errors, *(f"  {region.text}" for region in self.where)]


@dataclass(frozen=True, kw_only=True, repr=False)
class Diagnosis(Result):
    """Which physical effect is missing."""

    verdict: Verdict
    esr_before: PerSignal
    esr_after: PerSignal
    candidates: tuple[Candidate, ...]
    """Best first."""
    classes: tuple[tuple[str, ...], ...]
    """Sets whose members no recording could separate."""
    next_command: str | None
    """The command that goes on from here, where recordings and model are files."""
    noise_floor: PerSignal | None = None

    @property
    def effects(self) -> tuple[str, ...]:
        """What is missing, in the order in which it should be added."""
        return self.verdict.effects

    def _summary(self) -> list[str]:
        verdict = self.verdict
        lines = [f"verdict: {verdict.kind.replace('_', ' ')} {', '.join(verdict.effects)}".rstrip()]
        lines += [f"  {line}" for line in verdict.text.splitlines()]
        if verdict.next_experiment:
            lines.append(f"next recording: {verdict.next_experiment}")
        return lines


@dataclass(frozen=True, kw_only=True, repr=False)
class Addition(_WithParameters, _WithModel, Result):
    """A model with effects added, and the error before and after."""

    effects: tuple[str, ...]
    terms: tuple[str, ...]
    esr_before: PerSignal
    esr_after: PerSignal
    held_out_before: PerSignal
    held_out_after: PerSignal
    noise_floor: PerSignal
    parameters: tuple[Parameter, ...]
    notes: tuple[str, ...]
    accepted: bool
    """Whether the error falls on data held out."""

    def _summary(self) -> list[str]:
        return [
            f"held out, before: {_both(self.held_out_before)}",
            f"held out, after:  {_both(self.held_out_after)}",
            *_rows(self.parameters),
            *(f"note: {note}" for note in self.notes),
            "accepted" if self.accepted else "not accepted",
        ]


@dataclass(frozen=True, kw_only=True, repr=False)
class Prediction(_WithSeries, Result):
    """A model's free run on a voltage."""

    samples: int
    sample_time_s: float
    input: str
    band: float | None
    """Share of what the motor does that the band is to hold."""
    extrapolated: tuple[Stretch, ...] | None
    """``None``: the model does not remember what its fit has seen."""
    end: End | None = field(metadata={"json": "final"})

    def _summary(self) -> list[str]:
        lines = [f"{self.samples} samples, {self.sample_time_s} s apart, voltage {self.input}"]
        if self.end is not None:
            end = self.end
            lines.append(f"ends at {end.t_s:.4f} s: {end.i_a.value:.5g} A, {end.omega_rad_s.value:.5g} rad/s")
        lines += [f"extrapolated: {s.quantity} from {s.from_s:.4f} s to {s.to_s:.4f} s" for s in self.extrapolated or ()]
        return lines


@dataclass(frozen=True, kw_only=True, repr=False)
class Check(Result):
    """What is wrong with recordings."""

    @property
    def is_usable(self) -> bool:
        """Whether nothing was found that makes every answer meaningless."""
        return all(finding.severity != "stop" for finding in self.data_findings)

    def _summary(self) -> list[str]:
        lines = [f"{f.severity}: {f.recording}: {f.text}" for f in self.data_findings]
        return lines or ["nothing is wrong"]


@dataclass(frozen=True, kw_only=True)
class Epoch:
    """Errors after an epoch."""

    rmse_trn: float
    rmse_chk: float | None


@dataclass(frozen=True, kw_only=True, repr=False)
class Training(_WithModel, Result):
    """A learned correction, and what it does."""

    epochs: tuple[Epoch, ...]
    rmse_trn: float
    rmse_chk: float | None
    esr_before: PerSignal
    esr_after: PerSignal
    held_out_before: PerSignal
    held_out_after: PerSignal
    noise_floor: PerSignal
    correction_share: float | None
    """Share of the current that the correction makes; physics makes the rest."""
    accepted: bool
    notes: tuple[str, ...]

    def _summary(self) -> list[str]:
        return [
            f"held out, before: {_both(self.held_out_before)}",
            f"held out, after:  {_both(self.held_out_after)}",
            f"the correction makes {_percent(self.correction_share)} of the current, physics the rest",
            *(f"note: {note}" for note in self.notes),
            "accepted" if self.accepted else "not accepted",
        ]


@dataclass(frozen=True, kw_only=True)
class Detector:
    """What the detector takes for healthy."""

    nominal_voltage: float
    current: float
    speed: float
    sparking: float
    current_jump: float
    speed_jump: float
    current_deviation: tuple[float, float]
    speed_deviation: tuple[float, float]
    runs: int
    motors: int
    holds: tuple[float, float]
    """Share of healthy motors that all limits are to hold, and the confidence in that."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Calibration(_WithModel, Result):
    """A model with the detector's limits."""

    detector: Detector
    without_lot: str | None
    """Why the runs do not tell what is usual in the lot, where they do not."""

    def _summary(self) -> list[str]:
        d = self.detector
        share, confidence = (100 * part for part in d.holds)
        return [
            f"limits from {d.runs} runs of {d.motors} motors; {share:.1f} % of healthy motors, {confidence:.0f} % confidence",
            f"error of the current {_percent(d.current)}, of the speed {_percent(d.speed)}",
            *([] if self.without_lot is None else [f"without what is usual in the lot: {self.without_lot}"]),
        ]


@dataclass(frozen=True, kw_only=True)
class Alarm:
    """An alarm, from its first period to its last."""

    t_s: float
    until_s: float
    kind: str
    """``electrical``, ``mechanical`` or ``sensor``."""
    cause: str
    suspect: str
    ratio: float
    """Largest ratio to the limit."""


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A fault that the balances say."""

    kind: str
    text: str
    ratio: float
    look_at: str


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """The test of one motor."""

    recording: str
    verdict: str
    """``pass``, ``fail`` or ``cannot_judge``."""
    reasons: tuple[str, ...]
    alarms: tuple[Alarm, ...]
    periods: tuple[int, int]
    """Periods that were judged, and all."""
    serial: str | None = None
    findings: tuple[Fault, ...] = ()


@dataclass(frozen=True, kw_only=True, repr=False)
class Monitoring(Result):
    """Motors that were judged."""

    verdict: str
    """The worst of all."""
    alarms: tuple[Alarm, ...]
    runs: tuple[Judgement, ...]

    def _summary(self) -> list[str]:
        def line(run: Judgement) -> str:
            why = [f.text for f in run.findings] or [a.cause for a in run.alarms] or list(run.reasons)
            return f"{run.recording}: {run.verdict.replace('_', ' ')}" + (f" ({why[0]})" if why else "")

        return [line(run) for run in self.runs]
