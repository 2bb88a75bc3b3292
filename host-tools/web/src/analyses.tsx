// Signals by frequency and by order, residuals by lag, and a motor's laws: of the time that the panes show.
import { useEffect, useState } from "preact/hooks";
import type { Correlation, Correlations, LawPlane, Spectrum } from "./api";
import { Chart, type ChartLine } from "./chart";
import { changing, correlations, lawPlanes, spectrum, state, type Wanted } from "./server";
import { COMPARED, lines, panes, type Line, type Pane } from "./signals";
import { mode, present, recording, shown, simulated } from "./view";

/** What the server answers to a question that is asked anew as its key changes, or why it does not. */
function useAnswer<T>(key: string, ask: () => Promise<T>): { answer: T | null; wrong: string | null } {
  const [found, set] = useState<{ answer: T | null; wrong: string | null }>({ answer: null, wrong: null });
  const busy = changing.value;
  useEffect(() => {
    let wanted = !busy;
    if (wanted) ask().then((answer) => wanted && set({ answer, wrong: null }), (error: Error) => wanted && set({ answer: null, wrong: error.message }));
    return () => { wanted = false; };
  }, [key, busy]);
  return found;
}

function spectral(s: Spectrum, line: Line): ChartLine {
  // The mean stands at zero, which a logarithmic axis does not have.
  const xs = Float64Array.from({ length: s.amplitude.length - 1 }, (_, k) => (k + 1) * s.step);
  return { name: line.name, colour: line.colour, xs, ys: s.amplitude.slice(1), width: line.width ?? 1, ...(line.dash ? { dash: line.dash.join(" ") } : {}) };
}

function SpectrumView({ pane, last }: { pane: Pane; last: boolean }) {
  const over = mode.value === "order" ? "order" : "frequency", time = shown.value, r = recording.value;
  const recorded: Wanted | null = r && r.channels.some((c) => c.column === pane.channel) ? { recording: r.id, channel: pane.channel, of: "raw" } : null;
  // What is compared has passed a filter; what was recorded goes further up.
  const all: Line[] = [...(recorded && !pane.residual && simulated.value && COMPARED.includes(pane.channel) ? [{ name: "as recorded", colour: "--muted", width: 0.8, wanted: recorded }] : []), ...lines(pane)]
    .map((line) => { const { rms: _, ...wanted } = line.wanted; return { ...line, wanted }; });
  const key = JSON.stringify([over, time, all.map((l) => l.wanted), state.value?.basis]);
  const { answer, wrong } = useAnswer(key, () => Promise.all(all.map((line) => spectrum(line.wanted, over, time).then((s) => spectral(s, line)))));
  const unit = over === "order" ? "order" : "Hz", of = pane.unit.includes("/") ? `(${pane.unit})` : pane.unit;
  const first = answer?.[0]?.xs;
  if (wrong) return <p class="muted">{pane.label}: {wrong}</p>;
  return <Chart name={pane.key} file={`${pane.key}_by_${over}`} label={pane.label} x={unit} y={`${of}/√${unit}`} logX logY rangeX={first?.length ? [first[0]!, first[first.length - 1]!] : undefined} lines={answer ?? []} bottom={last} />;
}

const lagged = (c: Correlation): number[] => c.values.map((_, k) => 1000 * (c.first_s + k * c.step_s));

function CorrelationView({ pane }: { pane: Pane }) {
  const v = present.value, r = recording.value, time = shown.value;
  const { answer, wrong } = useAnswer<Correlations | null>(JSON.stringify([v?.id, r?.id, pane.channel, time, state.value?.basis]),
    async () => (v && r ? correlations(r.id, pane.channel, v.id, time) : null));
  if (wrong) return <p class="muted">{pane.label}: {wrong}</p>;
  const chart = (name: string, label: string, c: Correlation | null) => (c
    ? <Chart name={`${name}-${pane.channel}`} file={`${pane.channel}_${name}`} label={label} x="ms" y="" rangeY={[-1.05, 1.05]} band={{ low: -c.bound, high: c.bound }} lines={[{ name: label, colour: "--residual", xs: lagged(c), ys: c.values, as: "stems" }]} />
    : null);
  return <div class="row">{chart("autocorrelation", `${pane.label} with its past`, answer?.own ?? null)}{chart("cross-correlation", `${pane.label} with the voltage (right: later)`, answer?.input ?? null)}</div>;
}

const SHORT: Record<string, string> = { "voltage over current": "u over i", "flux over current": "Ψ over i", "torque over speed": "T over ω" };

function Planes() {
  const v = present.value, r = recording.value, time = shown.value;
  const { answer, wrong } = useAnswer<LawPlane[]>(JSON.stringify([v?.id, r?.id, time, state.value?.basis]), async () => (v && r ? lawPlanes(r.id, v.id, time) : []));
  if (wrong) return <p class="muted">{wrong}</p>;
  const colours: Record<string, string> = { measured: "--measured", model: "--modelled" };
  return <div class="row planes">{(answer ?? []).map((p) => <Chart key={p.name} name={p.name.replaceAll(" ", "-")} label={SHORT[p.name] ?? p.name} x={p.x_unit} y={p.y_unit}
    lines={p.loci.map((l) => ({ name: l.name, colour: colours[l.name] ?? "--ghost", xs: l.x, ys: l.y, as: "dots" as const }))} />)}</div>;
}

export function Analyses() {
  const all = panes();
  if (mode.value === "plane") return <div class="analyses"><Planes /></div>;
  if (mode.value === "correlation") {
    return <div class="analyses">{all.filter((p) => p.residual).map((pane) => <CorrelationView key={pane.key} pane={pane} />)}
      <p class="muted">Within the band by chance at 99 of 100 lags: of the past, were the residual white; of the voltage, were it independent of it (Ljung 1999, 16.6). In free run it need not be white; on the mains both repeat for ever, and the band is wide.</p></div>;
  }
  return <div class="analyses">{all.map((pane, k) => <SpectrumView key={pane.key} pane={pane} last={k === all.length - 1} />)}</div>;
}
