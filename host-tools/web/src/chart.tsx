// Curves over an axis, with the limits that they keep, what they are under the pointer, and themselves as a file.
import { useEffect, useRef, useState } from "preact/hooks";
import { columns, save, saveDrawing } from "./exports";
import { rounded } from "./format";
import { decades, dots, extent, nearest, path, scale, ticks } from "./plotting";

export interface ChartLine {
  name: string; colour: string; xs: ArrayLike<number>; ys: ArrayLike<number | null>;
  dash?: string; width?: number; as?: "line" | "stems" | "dots";
}
export interface Limits { low: number | null; high: number }
export interface Span { from: number; to: number; title: string }
interface Props {
  name: string; label: string; x: string; y: string; lines: ChartLine[]; band?: Limits | undefined; spans?: Span[] | undefined; logX?: boolean; logY?: boolean;
  rangeX?: [number, number] | undefined; rangeY?: [number, number] | undefined; file?: string; bottom?: boolean;
}

const LEFT = 54, RIGHT = 8, TOP = 4;
const number = (x: number) => (Math.abs(x) >= 1e5 || (x !== 0 && Math.abs(x) < 1e-3) ? x.toExponential(0).replace("e+", "e") : String(Number(x.toPrecision(6))));

export function Chart({ name, label, x, y, lines, band, spans = [], logX = false, logY = false, rangeX, rangeY, file = name, bottom = true }: Props) {
  const box = useRef<HTMLDivElement>(null), svg = useRef<SVGSVGElement>(null);
  const [[width, height], set] = useState([320, 120]);
  const [at, move] = useState(-1);
  useEffect(() => {
    const watch = new ResizeObserver(([entry]) => { if (entry) set([Math.max(80, entry.contentRect.width), Math.max(40, entry.contentRect.height)]); });
    if (box.current) watch.observe(box.current);
    return () => watch.disconnect();
  }, []);
  const below = bottom ? 20 : 4;
  const first = lines[0];
  const [x0, x1] = rangeX ?? extent(lines.map((l) => l.xs), logX);
  const limits = band ? [[band.low ?? (logY ? band.high : 0), band.high]] : [];
  const [y0, y1] = rangeY ?? extent([...lines.map((l) => l.ys), ...limits], logY);
  const X = scale(x0, x1, LEFT, width - RIGHT, logX), Y = scale(y0, y1, height - below, TOP, logY);
  const xTicks = logX ? decades(x0, x1, width / 60) : ticks(x0, x1, Math.max(3, width / 90)), yTicks = logY ? decades(y0, y1, height / 26) : ticks(y0, y1, Math.max(2, height / 34));
  const clamp = (v: number) => Y(Math.min(y1, Math.max(y0, v)));
  // What has no order along the axis cannot be read along it.
  const readable = first && first.as !== "dots" ? first : lines.length && lines[0]!.xs.length < 200 ? first : undefined;
  const told = readable && first && at >= 0 && at < first.xs.length
    ? `${rounded(first.xs[at], 5)} ${x}: ${lines.map((l) => [l, l.ys[nearest(l.xs, first.xs[at]!)]] as const).filter(([, v]) => v != null).map(([l, v]) => `${l.name} ${rounded(v, 4)}`).join(", ")} ${y}` : "";
  const point = (event: MouseEvent) => {
    if (!first || !svg.current) return;
    const px = event.clientX - svg.current.getBoundingClientRect().left, share = (px - LEFT) / Math.max(1, width - LEFT - RIGHT);
    move(nearest(first.xs, logX ? 10 ** (Math.log10(x0) + share * Math.log10(x1 / x0)) : x0 + share * (x1 - x0)));
  };
  const keys = (event: KeyboardEvent) => {
    const by = { ArrowLeft: -1, ArrowRight: 1, PageUp: 20, PageDown: -20 }[event.key];
    if (event.key === "Escape") move(-1);
    else if (by == null || !first) return;
    else move(Math.min(first.xs.length - 1, Math.max(0, at + by)));
    event.preventDefault();
  };
  return (
    <figure class="chart" data-chart={name}>
      <figcaption><span class="caption"><b>{label}</b> <span class="muted">{y}</span>
        {lines.length > 1 ? lines.map((l) => <span class="key" key={l.name}><i style={{ borderTopColor: `var(${l.colour})`, borderTopStyle: l.dash ? "dashed" : "solid" }} />{l.name}</span>) : null}
        <output>{told}</output></span>
        <span class="saves">
          <button class="small bare" title={`Save “${label}” as SVG`} onClick={() => svg.current && saveDrawing(svg.current, `${file}.svg`)}>SVG</button>
          <button class="small bare" title={`Save “${label}” as PNG`} onClick={() => svg.current && saveDrawing(svg.current, `${file}.png`)}>PNG</button>
          <button class="small bare" title={`Save the values of “${label}” as CSV`} onClick={() => save(`${file}.csv`, new Blob([columns(x, lines)], { type: "text/csv" }))}>CSV</button>
        </span>
      </figcaption>
      <div class="box" ref={box}>
        <svg ref={svg} width={width} height={height} tabIndex={0} role="img" aria-label={`${label}, ${y} over ${x}: ${lines.map((l) => l.name).join(", ")}. Arrow keys read the values.`}
          onMouseMove={point} onMouseLeave={() => move(-1)} onKeyDown={keys}>
          {band ? <rect class="band" x={LEFT} width={Math.max(0, width - LEFT - RIGHT)} y={clamp(band.high)} height={Math.max(0, clamp(band.low ?? y0) - clamp(band.high))} /> : null}
          {spans.map((s) => <rect class="alarm" x={X(Math.max(x0, s.from))} width={Math.max(2, X(Math.min(x1, s.to)) - X(Math.max(x0, s.from)))} y={TOP} height={Math.max(0, height - below - TOP)}><title>{s.title}</title></rect>)}
          {yTicks.map((v) => <g><line class="grid" x1={LEFT} x2={width - RIGHT} y1={Y(v)} y2={Y(v)} /><text x={LEFT - 4} y={Y(v) + 3} text-anchor="end">{number(v)}</text></g>)}
          {xTicks.map((v) => <g><line class="grid" y1={TOP} y2={height - below} x1={X(v)} x2={X(v)} />{bottom && X(v) < width - RIGHT - 10 - 7 * x.length ? <text x={X(v)} y={height - 6} text-anchor="middle">{number(v)}</text> : null}</g>)}
          {bottom ? <text class="axis" x={width - RIGHT} y={height - 6} text-anchor="end">{x}</text> : null}
          {band ? <g class="limit">{band.low != null ? <line x1={LEFT} x2={width - RIGHT} y1={clamp(band.low)} y2={clamp(band.low)} /> : null}<line x1={LEFT} x2={width - RIGHT} y1={clamp(band.high)} y2={clamp(band.high)} /></g> : null}
          {lines.map((l) => (l.as === "dots"
            ? <path class="dots" d={dots(l.xs, l.ys, X, Y)} style={{ fill: "none", stroke: `var(${l.colour})`, strokeWidth: l.width ?? 2, strokeLinecap: "round" }} />
            : l.as === "stems"
              ? <g style={{ stroke: `var(${l.colour})`, fill: `var(${l.colour})` }}>{Array.from(l.xs, (v, k) => <g><line x1={X(v)} x2={X(v)} y1={clamp(0)} y2={clamp(l.ys[k] ?? 0)} /><circle cx={X(v)} cy={clamp(l.ys[k] ?? 0)} r={2} stroke="none" /></g>)}</g>
              : <path d={path(l.xs, l.ys, X, Y)} style={{ fill: "none", stroke: `var(${l.colour})`, strokeWidth: l.width ?? 1.2, ...(l.dash ? { strokeDasharray: l.dash } : {}) }} />))}
          {readable && first && at >= 0 && at < first.xs.length ? <line class="reading" x1={X(first.xs[at]!)} x2={X(first.xs[at]!)} y1={TOP} y2={height - below} /> : null}
        </svg>
      </div>
    </figure>
  );
}
