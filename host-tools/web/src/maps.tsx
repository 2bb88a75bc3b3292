// Maps of the residual; a cell that is chosen lights up its instants in the panes.
import { useEffect, useRef, useState } from "preact/hooks";
import type { Map as Residual } from "./api";
import { cellFill, css } from "./colours";
import { cells, cellTable } from "./drawings";
import { save, saveText } from "./exports";
import { rounded } from "./format";
import { map, state } from "./server";
import { brush, dark, planes, present, quantity, visited } from "./view";

const TITLES: Record<string, string> = { i_omega: "i, ω", phase_u: "phase, u" };
const WORDS: Record<string, string> = { i_omega: "current and speed", phase_u: "phase of the mains and voltage" };
const SYMBOLS = { current: "Δi", speed: "Δω" };
/** Mean error of the strongest colour. */
const most = (m: Residual): number => {
  const least = Math.max(...m.counts) > 200 ? 3 : 1;
  return Math.max(...m.mean.map((x, k) => ((m.counts[k] ?? 0) >= least ? Math.abs(x) : 0)), 1e-30);
};

/** Draws cells: hue by sign, lightness by size, and a stroke through those in which the model is too low. */
function draw(canvas: HTMLCanvasElement, m: Residual, chosen: Set<number>, seen: Set<number>, focus: number): void {
  const across = m.x.edges.length - 1, up = m.y.edges.length - 1;
  const width = (canvas.width = canvas.clientWidth * devicePixelRatio), height = (canvas.height = canvas.clientHeight * devicePixelRatio);
  const ctx = canvas.getContext("2d");
  if (!ctx) return;
  const [text, empty] = ["--text", "--panel"].map(css) as [string, string];
  ctx.fillStyle = empty;
  ctx.fillRect(0, 0, width, height);
  const place = (cell: number) => {
    const [column, row] = [cell % across, Math.floor(cell / across)];
    const [x, end] = [(column / across) * width, ((column + 1) / across) * width].map(Math.round) as [number, number];
    const [y, bottom] = [((up - row - 1) / up) * height, ((up - row) / up) * height].map(Math.round) as [number, number];
    return { x, y, w: end - x, h: bottom - y };
  };
  const of = coloured(m);
  m.mean.forEach((_, cell) => {
    const colour = of(cell), { x, y, w, h } = place(cell);
    if (!colour) return;
    ctx.fillStyle = colour.fill;
    ctx.fillRect(x, y, w, h);
    if (colour.stroke) {
      ctx.strokeStyle = colour.stroke; ctx.lineWidth = devicePixelRatio * 0.7;
      ctx.beginPath(); ctx.moveTo(x, y + h); ctx.lineTo(x + w, y); ctx.stroke();
    }
  });
  const outline = (cells: Iterable<number>, colour: string, thick: number) => {
    ctx.strokeStyle = colour; ctx.lineWidth = thick * devicePixelRatio;
    for (const cell of cells) { const { x, y, w, h } = place(cell); ctx.strokeRect(x + 0.5, y + 0.5, w - 1, h - 1); }
  };
  outline(seen, css("--seen"), 0.8);
  outline(chosen, text, 2);
  if (focus >= 0 && document.activeElement === canvas) outline([focus], css("--accent"), 2);
}

/** Colour of a cell, and of the stroke through it. */
function coloured(m: Residual): (cell: number) => { fill: string; stroke: string | null } | null {
  const of = cellFill(most(m));
  return (cell) => (m.counts[cell] ? of(m.mean[cell] ?? 0) : null);
}

async function saveMap(m: Residual, of: "current" | "speed", plane: string, ending: "svg" | "png" | "csv"): Promise<void> {
  const name = `map_${of}_${plane}.${ending}`;
  if (ending === "csv") { save(name, new Blob([cellTable(m)], { type: "text/csv" })); return; }
  const text = cells(`${SYMBOLS[of]} over ${TITLES[plane]}, ± ${rounded(most(m), 2)} ${m.unit}`, m, coloured(m), { ground: css("--ground"), text: css("--text"), muted: css("--muted"), grid: css("--grid") });
  const [, width, height] = /width="(\d+)" height="(\d+)"/.exec(text)?.map(Number) ?? [0, 0, 0];
  await saveText(text, width ?? 0, height ?? 0, name);
}

function MapView({ plane }: { plane: string }) {
  const at = useRef<HTMLCanvasElement>(null);
  const [m, set] = useState<Residual | null>(null);
  const [focus, move] = useState(-1);
  const [tip, say] = useState("");
  const dragging = useRef(false);
  const version = present.value?.id, of = quantity.value, basis = state.value?.basis;
  useEffect(() => {
    let wanted = true;
    if (version != null) map(version, plane, of).then((found) => wanted && set(found), () => wanted && set(null));
    return () => { wanted = false; };
  }, [version, plane, of, basis]);
  const chosen = new Set(brush.value?.plane === plane ? brush.value.cells : []), seen = visited.value[plane] ?? new Set<number>();
  useEffect(() => {
    const canvas = at.current;
    if (!canvas || !m) return;
    const again = () => draw(canvas, m, chosen, seen, focus);
    again();
    const watch = new ResizeObserver(again);
    watch.observe(canvas);
    return () => watch.disconnect();
  }, [m, brush.value, visited.value, focus, dark.value]);
  if (!m) return null;
  const across = m.x.edges.length - 1, up = m.y.edges.length - 1;
  const cellAt = (event: MouseEvent) => {
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
    const column = Math.min(across - 1, Math.max(0, Math.floor(((event.clientX - box.left) / box.width) * across)));
    const row = Math.min(up - 1, Math.max(0, Math.floor((1 - (event.clientY - box.top) / box.height) * up)));
    return row * across + column;
  };
  const told = (cell: number) => {
    const column = cell % across, row = Math.floor(cell / across);
    const part = (axis: Residual["x"], k: number) => `${rounded(axis.edges[k], 3)} … ${rounded(axis.edges[k + 1], 3)} ${axis.unit}`;
    const count = m.counts[cell] ?? 0;
    const error = count ? `mean ${rounded(m.mean[cell], 3)} ${m.unit}, RMS ${rounded(m.rms[cell], 3)} ${m.unit}, ${count} samples` : "never there";
    return `${error}: ${part(m.x, column)}, ${part(m.y, row)}`;
  };
  const choose = (cell: number, more: boolean) => {
    if (!m.counts[cell]) { brush.value = null; return; }
    const before = more || chosen.has(cell) ? [...chosen] : [];
    const cells = chosen.has(cell) ? before.filter((other) => other !== cell) : [...before, cell];
    brush.value = cells.length ? { plane, cells } : null;
  };
  const key = (event: KeyboardEvent) => {
    const now = focus < 0 ? Math.floor(up / 2) * across + Math.floor(across / 2) : focus;
    const step: Record<string, number> = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: across, ArrowDown: -across };
    const by = step[event.key];
    if (by != null) { const next = now + by; if (next >= 0 && next < across * up) { move(next); say(told(next)); } }
    else if (event.key === "Enter" || event.key === " ") choose(now, event.shiftKey);
    else if (event.key === "Escape") brush.value = null;
    else return;
    event.preventDefault();
  };
  return (
    <figure class="map" data-plane={plane}>
      <figcaption title={`Mean error of the ${of} over ${WORDS[plane]}; the strongest colour is ${rounded(most(m), 2)} ${m.unit}`}>{SYMBOLS[of]} over {TITLES[plane]}: ± {rounded(most(m), 2)} {m.unit}</figcaption>
      <div class="frame">
        <span class="y">{m.y.name}, {m.y.unit}</span>
        <span class="top">{rounded(m.y.edges[up], 3)}</span><span class="bottom">{rounded(m.y.edges[0], 3)}</span>
        <canvas ref={at} tabIndex={0} role="application" aria-label={`Map of the ${of}'s error over ${WORDS[plane]}; arrow keys move, Enter chooses a cell`} title={tip}
          onMouseMove={(event) => { const cell = cellAt(event); say(told(cell)); if (dragging.current && event.buttons === 1 && !chosen.has(cell)) choose(cell, true); }}
          onMouseDown={(event) => { dragging.current = true; move(cellAt(event)); choose(cellAt(event), event.shiftKey); }} onMouseUp={() => { dragging.current = false; }}
          onKeyDown={key} onMouseLeave={() => { if (document.activeElement !== at.current) say(""); }} onBlur={() => say("")} onFocus={() => move(focus < 0 ? Math.floor(up / 2) * across + Math.floor(across / 2) : focus)} />
        <span class="left">{rounded(m.x.edges[0], 3)}</span><span class="x">{m.x.name}, {m.x.unit}</span><span class="right">{rounded(m.x.edges[across], 3)}</span>
      </div>
      {tip ? <output>{tip}</output> : <div class="saves">{(["svg", "png", "csv"] as const).map((ending) => <button class="small bare" title={`Save this map as ${ending.toUpperCase()}`} onClick={() => saveMap(m, of, plane, ending)}>{ending.toUpperCase()}</button>)}</div>}
    </figure>
  );
}

export function Maps() {
  if (!present.value || !planes.value.length || !state.value?.recordings.some((r) => r.role !== "off" && !r.unusable)) return null;
  return (
    <section id="maps" aria-label="Where the model fails">
      <div class="switch" role="group" aria-label="Which error">
        {(["current", "speed"] as const).map((of) => <button class="small" aria-pressed={quantity.value === of} onClick={() => { quantity.value = of; }}>{of}</button>)}
        {brush.value ? <button class="small" onClick={() => { brush.value = null; }}>Clear the brush</button> : null}
        <span class="scale" title="Of the model: its mean against what was measured"><i class="too-low" />too low<i class="too-high" />too high</span>
      </div>
      <div class="row">{planes.value.map((plane) => <MapView key={plane} plane={plane} />)}</div>
    </section>
  );
}
