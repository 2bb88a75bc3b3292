// Linked panes over time: voltage, current, speed, and what the model leaves of them.
import { effect, signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import uPlot from "uplot";
import { Analyses } from "./analyses";
import { css } from "./colours";
import { stacked, type Stacked } from "./drawings";
import { picture, save, saveText, table } from "./exports";
import { frequency, rounded, withPrefix } from "./format";
import { points } from "./points";
import { changing, curve } from "./server";
import { asked, COMPARED, lines, panes, type Line, type Pane } from "./signals";
import { cursors, dark, ghost, hovered, lit, mode, present, type Mode, range, recording, shown, simulated, whole, zoom } from "./view";

/** Stretches that a pane of a width has room for. */
const room = (width: number) => Math.max(100, Math.ceil(width - 60));
/** Milliseconds for which the view has to rest before curves are brought that nobody has asked for yet. */
const REST = 400;
let later = 0;
// The curves of the candidates are there before the pointer is.
effect(() => {
  const r = recording.value, v = present.value, time = shown.value;
  const ready = v?.diagnosis?.candidates.filter((c) => c.step === 1 && c.predicted != null) ?? [];
  const all = panes().filter((pane) => COMPARED.includes(pane.channel));
  const wanted = r && v && simulated.value
    ? ready.flatMap((c) => all.map((pane) => asked(r, pane.channel, pane.residual ? "residual" : "modelled", v.id, c.effect))) : [];
  clearTimeout(later);
  if (!wanted.length || changing.value) return;
  later = setTimeout(async () => {
    for (const one of wanted) {
      const width = document.querySelector(".plot")?.clientWidth;
      if (width == null || shown.peek() !== time || present.peek()?.id !== v?.id || changing.peek()) return;
      await curve(one, time, room(width));
    }
  }, REST);
});

/** Milliseconds in which curves come without a sign that they are on their way. */
const SOON = 150;

const sync = uPlot.sync("panes");
/** How often something was drawn, for whoever waits for it. */
export const drawn = signal(0);

class Plot {
  private plot: uPlot | null = null;
  private asked = 0;
  private made = "";
  private time: [number, number] = [0, 1];
  private readonly watch: ResizeObserver;
  private readonly stop: () => void;

  constructor(private readonly at: HTMLElement, private readonly say: (text: string) => void, private readonly key: string, private readonly last: boolean) {
    this.watch = new ResizeObserver(() => { this.size(); void this.draw(); });
    this.watch.observe(at);
    const draw = effect(() => {
      void [shown.value, mode.value, recording.value, present.value, ghost.value, hovered.value, dark.value, simulated.value];
      void this.draw();
    });
    const marks = effect(() => { void [lit.value, cursors.value]; this.plot?.redraw(false); });
    this.stop = () => { draw(); marks(); };
  }

  destroy(): void {
    this.stop();
    this.watch.disconnect();
    // What is on its way comes too late.
    this.asked += 1;
    if (this.plot) sync.unsub(this.plot);
    this.plot?.destroy();
    this.plot = null;
  }

  private size(): void {
    const { clientWidth: width, clientHeight: height } = this.at;
    if (this.plot && width > 0 && height > 0) this.plot.setSize({ width, height });
  }

  private async draw(): Promise<void> {
    const pane = panes().find((p) => p.key === this.key);
    const width = this.at.clientWidth, height = this.at.clientHeight;
    if (!pane || width < 50 || height < 20) return;
    const all = lines(pane), time = shown.value;
    const mine = ++this.asked;
    // What comes at once needs no sign.
    const sign = setTimeout(() => this.at.classList.add("waiting"), SOON);
    const windows = await Promise.all(all.map((line) => curve(line.wanted, time, room(width))));
    clearTimeout(sign);
    // Meanwhile something else is looked at.
    if (mine !== this.asked) return;
    this.at.classList.remove("waiting");
    const data = points(windows);
    // Dashes of a band from least to largest would only flicker.
    this.time = time;
    const dense = windows.some((w) => w && w.samples > 4);
    const style = JSON.stringify([dense, all.map(({ name, colour, dash }) => [name, colour, dash]), dark.value, pane.unit]);
    if (style !== this.made || !this.plot) {
      if (this.plot) { sync.unsub(this.plot); this.plot.destroy(); }
      this.plot = this.begin(pane, dense ? all.map(({ dash: _, ...line }) => line) : all, data, width, height);
      this.made = style;
    } else {
      this.plot.setData(data);
    }
    this.at.dataset["from"] = String(time[0]);
    this.at.dataset["to"] = String(time[1]);
    this.at.dataset["lines"] = all.map((l, k) => (windows[k] ? l.name : "")).filter(Boolean).join("; ");
    this.at.dataset["exact"] = String(windows.every((w) => !w || w.samples === 1));
    drawn.value += 1;
  }

  private begin(pane: Pane, all: Line[], data: uPlot.AlignedData, width: number, height: number): uPlot {
    const grid = { stroke: css("--grid"), width: 1 }, font = "11px system-ui, sans-serif", stroke = css("--muted");
    const axis = { font, stroke, grid, ticks: { ...grid, size: 3 }, gap: 2 };
    const plot = new uPlot({
      width, height, padding: [4, 8, this.last ? 0 : 4, 0],
      legend: { show: false },
      cursor: {
        sync: { key: sync.key, scales: ["x", null] }, drag: { x: true, y: false, setScale: false }, focus: { prox: 1e6 }, points: { size: 5 },
        bind: { dblclick: () => () => { range.value = null; return null; } },
      },
      scales: { x: { time: false, range: () => this.time }, y: { range: (_u, low, high) => {
        if (low == null || high == null) return [0, 1];
        const room = 0.06 * Math.max(high - low, 1e-9 + 1e-6 * Math.abs(high));
        return [low - room, high + room];
      } } },
      axes: [
        { ...axis, size: this.last ? 22 : 0, show: true, values: (_u, xs) => xs.map((x) => (this.last ? `${Number(x.toPrecision(9))} s` : "")) },
        { ...axis, size: 52, space: 26, values: (_u, ys) => ys.map((y) => String(Number(y.toPrecision(6)))) },
      ],
      series: [{}, ...all.map((line) => ({
        stroke: css(line.colour), width: line.width ?? 1, points: { show: false }, spanGaps: false, ...(line.dash ? { dash: line.dash } : {}),
      }))],
      hooks: {
        drawClear: [(u) => this.light(u)],
        draw: [(u) => this.marks(u)],
        setSelect: [(u) => {
          if (u.select.width < 4) return;
          const [from, to] = [u.select.left, u.select.left + u.select.width].map((x) => u.posToVal(x, "x")) as [number, number];
          u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          zoom(from, to);
        }],
        setCursor: [(u) => this.tell(u, all, pane)],
      },
    }, data, this.at);
    plot.over.addEventListener("click", (event) => {
      if (Math.abs(event.movementX) > 2 || plot.select.width > 3) return;
      const t = plot.posToVal(event.offsetX, "x");
      cursors.value = event.shiftKey ? { ...cursors.value, b: t } : { ...cursors.value, a: t };
    });
    plot.over.addEventListener("wheel", (event) => {
      event.preventDefault();
      const [from, to] = shown.value, at = plot.posToVal(event.offsetX, "x");
      if (event.shiftKey) { const by = (to - from) * Math.sign(event.deltaY || event.deltaX) * 0.1; zoom(from + by, to + by); return; }
      const by = event.deltaY > 0 ? 1.25 : 0.8;
      zoom(at - (at - from) * by, at + (to - at) * by);
    }, { passive: false });
    return plot;
  }

  /** Lights up the instants of the cells that were chosen. */
  private light(u: uPlot): void {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.fillStyle = css("--lit");
    const [low, high] = shown.peek();
    for (const [from, to] of lit.peek()) {
      if (to < low || from > high) continue;
      const x = u.valToPos(Math.max(from, low), "x", true), end = u.valToPos(Math.min(to, high), "x", true);
      ctx.fillRect(x, bbox.top, Math.max(1, end - x), bbox.height);
    }
    ctx.restore();
  }

  private marks(u: uPlot): void {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
    for (const [name, t] of Object.entries(cursors.peek())) {
      const [low, high] = shown.peek();
      if (t == null || t < low || t > high) continue;
      const x = Math.round(u.valToPos(t, "x", true));
      ctx.strokeStyle = ctx.fillStyle = css(name === "a" ? "--measured" : "--modelled");
      ctx.setLineDash(name === "a" ? [] : [4, 3]);
      ctx.beginPath(); ctx.moveTo(x, bbox.top); ctx.lineTo(x, bbox.top + bbox.height); ctx.stroke();
      if (this.key === "u_v" || !document.querySelector("[data-pane=u_v]")) ctx.fillText(name.toUpperCase(), x + 3, bbox.top + 11 * devicePixelRatio);
    }
    ctx.restore();
  }

  /** What the curves show under the pointer. */
  private tell(u: uPlot, all: Line[], pane: Pane): void {
    const k = u.cursor.idx;
    if (k == null || (u.cursor.left ?? -1) < 0) { this.say(""); return; }
    const values = all.map((line, n) => {
      const y = u.data[n + 1]?.[k];
      return y == null ? "" : `${line.name} ${rounded(y)}`;
    });
    this.say(`${rounded(u.data[0][k], 6)} s: ${values.filter(Boolean).join(", ")} ${pane.unit}`);
  }
}

/** What lies between the cursors, as the curves show it. */
function Between() {
  const { a, b } = cursors.value;
  if (a == null) return <span class="muted">Drag to zoom, wheel about the pointer, double click for all. Click: cursor A, with shift: B.</span>;
  const clear = <button class="small" onClick={() => { cursors.value = { a: null, b: null }; }}>Clear</button>;
  if (b == null) return <span>A {rounded(a, 7)} s {clear}</span>;
  const apart = Math.abs(b - a);
  return <span class="between">A {rounded(a, 7)} s, B {rounded(b, 7)} s: Δt {withPrefix(apart, "s", 4)}{apart > 0 ? `, 1/Δt ${frequency(apart)}` : ""} {clear}</span>;
}

function PaneView({ pane, last }: { pane: Pane; last: boolean }) {
  const at = useRef<HTMLDivElement>(null), out = useRef<HTMLOutputElement>(null);
  useEffect(() => {
    const plot = new Plot(at.current!, (text) => { if (out.current) out.current.textContent = text; }, pane.key, last);
    return () => plot.destroy();
  }, [pane.key, last]);
  return (
    <figure class={`pane${last ? " last" : ""}`} data-pane={pane.key} aria-label={`${pane.label} in ${pane.unit} over time`}>
      <figcaption><b>{pane.label}</b> <span class="muted">{pane.unit}</span><output ref={out} /></figcaption>
      <div class="plot" ref={at} />
    </figure>
  );
}

function Legend() {
  const all = panes().flatMap((pane) => lines(pane));
  const unique = [...new Map(all.map((line) => [line.name, line])).values()];
  return <>{unique.map((line) => <span class={`key${/^(before|with)/.test(line.name) ? " long" : ""}`} title={line.name} key={line.name}><i style={{ borderTopColor: `var(${line.colour})`, borderTopStyle: line.dash ? "dashed" : "solid" }} />{line.name}</span>)}</>;
}

/** The most stretches that a file holds. */
const MOST = 16_000;

async function asCsv(): Promise<void> {
  const r = recording.value;
  if (!r) return;
  const all = panes().flatMap((pane) => lines(pane).map((line) => ({ name: line.name === "measured" ? pane.channel : `${pane.channel} ${line.name}`, wanted: line.wanted })));
  const columns = await Promise.all(all.map(async ({ name, wanted }) => ({ name: name.replaceAll(/[",\s]+/g, "_"), window: await curve(wanted, shown.value, MOST) })));
  save(`${r.name.replace(/\.\w+$/, "")}_shown.csv`, new Blob([table(r.name, columns)], { type: "text/csv" }));
}

async function asPng(): Promise<void> {
  const r = recording.value, made = await picture([...document.querySelectorAll("#panes .pane")], `${r?.name ?? ""}: ${present.value?.label ?? "recorded"}`);
  if (made) save(`${r?.name.replace(/\.\w+$/, "") ?? "signals"}.png`, made);
}

/** Height of a pane in a drawing, and the width of all. */
const DRAWN: [number, number] = [1000, 160];

async function asSvg(): Promise<void> {
  const r = recording.value, time = shown.value;
  if (!r) return;
  const all: Stacked[] = await Promise.all(panes().map(async (pane) => {
    const curves = lines(pane), windows = await Promise.all(curves.map((line) => curve(line.wanted, time, room(DRAWN[0]))));
    const [xs, ...ys] = points(windows) as unknown as [number[], ...(number | null)[][]];
    return { caption: `${pane.label}, ${pane.unit}`, xs, curves: curves.map((line, k) => ({ ys: ys[k] ?? [], colour: css(line.colour), name: line.name, ...(line.dash ? { dash: line.dash } : {}), ...(line.width ? { width: line.width } : {}) })) };
  }));
  const text = stacked(`${r.name}: ${present.value?.label ?? "recorded"}`, all, time, ...DRAWN, { ground: css("--ground"), text: css("--text"), muted: css("--muted"), grid: css("--grid") });
  await saveText(text, DRAWN[0], 0, `${r.name.replace(/\.\w+$/, "")}.svg`);
}

/** Arrow keys pan, plus and minus zoom, Home shows all. */
function keys(event: KeyboardEvent): void {
  const [from, to] = shown.value, span = to - from, middle = (from + to) / 2;
  const done: Record<string, () => void> = {
    ArrowLeft: () => zoom(from - span / 5, to - span / 5), ArrowRight: () => zoom(from + span / 5, to + span / 5),
    "+": () => zoom(middle - span / 4, middle + span / 4), "-": () => zoom(middle - span, middle + span),
    Home: () => { range.value = null; }, a: () => { cursors.value = { ...cursors.value, a: middle }; }, b: () => { cursors.value = { ...cursors.value, b: middle }; },
    Escape: () => { cursors.value = { a: null, b: null }; },
  };
  const act = done[event.key];
  if (act && !event.ctrlKey && !event.metaKey && !event.altKey) { act(); event.preventDefault(); }
}

const MODES: [Mode, string, string][] = [
  ["raw", "raw", "The signals themselves; least and largest value where there are more samples than pixels"], ["rms", "RMS", "RMS over each mains period"],
  ["spectrum", "spectrum", "Root of the power density over frequency, of the time shown"], ["order", "orders", "The same over orders of the rotor: what turns with it stands still"],
  ["correlation", "residual", "The residual's correlation with its past and with the voltage, with bounds"], ["plane", "planes", "Voltage and flux over current, torque over speed"],
];

function Modes() {
  const is = (of: Mode) => (mode.value === of);
  const can = (of: Mode) => (of === "rms" ? recording.value?.mains_s != null : of === "correlation" || of === "plane" ? simulated.value : true);
  return (
    <span class="roles" role="group" aria-label="What the panes show">
      {MODES.filter(([of]) => can(of)).map(([of, name, title]) => <button class="small" id={of === "raw" ? undefined : of} key={of} aria-pressed={is(of)} title={title} onClick={() => { mode.value = of; }}>{name}</button>)}
    </span>
  );
}

export function Panes() {
  const all = panes(), overTime = mode.value === "raw" || mode.value === "rms";
  const [from, to] = shown.value, [low, high] = whole.value;
  return (
    <section id="panes" aria-label="Signals" tabIndex={0} onKeyDown={keys} data-from={from} data-to={to} data-drawn={drawn.value}>
      <div class="legend"><b>{recording.value?.name}</b><Legend /><span class="grow" /><Modes /></div>
      {overTime ? all.map((pane, k) => <PaneView key={pane.key} pane={pane} last={k === all.length - 1} />) : <Analyses />}
      <div class="cursors">{overTime ? <Between /> : <span class="muted">Of {rounded(from, 4)} to {rounded(to, 4)} s: what the panes over time show.</span>}<span class="grow" />{from > low || to < high
        ? <button class="small" id="all" onClick={() => { range.value = null; }}>Show all</button> : null}
        {overTime ? <><button class="small bare" id="csv" title="What is shown as a CSV file; every sample where there are at most 16,000" onClick={asCsv}>CSV</button>
        <button class="small bare" id="png" title="What is shown as a picture" onClick={asPng}>PNG</button>
        <button class="small bare" id="svg" title="What is shown as a drawing" onClick={asSvg}>SVG</button></> : null}</div>
    </section>
  );
}
