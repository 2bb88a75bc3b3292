// What is learnt of what the physics leaves over: membership functions, response, and whether it holds on data held out.
import { useEffect, useRef, useState } from "preact/hooks";
import type { Correction, Lines, Surface } from "./api";
import { Chart, type ChartLine } from "./chart";
import { cellFill } from "./colours";
import { saveDrawing } from "./exports";
import { rounded } from "./format";
import { correction, state } from "./server";
import { command, dark, present } from "./view";
import { train, training } from "./work";

const COLOURS = ["--measured", "--modelled", "--residual", "--tried"];
const colour = (k: number) => COLOURS[k % COLOURS.length]!;

function lines(of: Lines, as: Partial<ChartLine> = {}, suffix = ""): ChartLine[] {
  return of.curves.map((c, k) => ({ name: `${c.name}${suffix}`, colour: colour(k), xs: c.x, ys: c.y, ...as }));
}

/** A response over two inputs: red above zero, blue and hatched below. */
function SurfaceView({ of }: { of: Surface }) {
  const svg = useRef<SVGSVGElement>(null), [tip, say] = useState("");
  const rows = Math.floor(of.values.length / of.columns), size = 5, strongest = Math.max(...of.values.map(Math.abs), 1e-30), fill = cellFill(strongest);
  const at = (range: [number, number], k: number, all: number) => range[0] + ((range[1] - range[0]) * (k + 0.5)) / all;
  const short = (name: string) => name.replace("modelled ", "");
  void dark.value;
  return (
    <figure class="surface">
      <figcaption><span class="caption"><b>{short(of.x)} and {short(of.y)}</b> <span class="muted">± {rounded(strongest, 2)} A</span></span>
        <span class="saves">{["svg", "png"].map((ending) => <button class="small bare" title={`Save the response over ${of.x} and ${of.y} as ${ending.toUpperCase()}`} onClick={() => svg.current && saveDrawing(svg.current, `response_${short(of.x)}_${short(of.y)}.${ending}`)}>{ending.toUpperCase()}</button>)}</span></figcaption>
      <svg ref={svg} width={size * of.columns} height={size * rows} viewBox={`0 0 ${size * of.columns} ${size * rows}`} role="img" preserveAspectRatio="none" aria-label={`Response over ${of.x} and ${of.y}`} onMouseLeave={() => say("")}>
        {of.values.map((v, k) => {
          const [column, row] = [k % of.columns, Math.floor(k / of.columns)], { fill: ground, stroke } = fill(v);
          const x = size * column, y = size * (rows - 1 - row);
          return <g onMouseEnter={() => say(`${rounded(v, 3)} A at ${rounded(at(of.x_range, column, of.columns), 3)}, ${rounded(at(of.y_range, row, rows), 3)}`)}>
            <rect x={x} y={y} width={size} height={size} fill={ground} />{stroke && (column + row) % 2 ? <line x1={x} y1={y + size} x2={x + size} y2={y} stroke={stroke} stroke-width={0.7} /> : null}</g>;
        })}
      </svg>
      <span class="muted">{tip || `across ${rounded(of.x_range[0], 3)} … ${rounded(of.x_range[1], 3)}, up ${rounded(of.y_range[0], 3)} … ${rounded(of.y_range[1], 3)}`}</span>
    </figure>
  );
}

function Learnt({ c }: { c: Correction }) {
  return <>
    <div class="told" tabIndex={0} role="region" aria-label="What was learnt">
      <p class={`note ${c.accepted ? "" : "warning"}`} id="learnt">{c.accepted ? "Accepted: " : "Not accepted, the error does not fall on data held out: "}{c.text}.</p>
      <div class="learning"><Chart name="learning" label="Error over the epochs" x={c.learning.x} y={c.learning.y} logY lines={lines(c.learning)} /></div>
      <h3>Response over two inputs, the other one in the middle of its range</h3>
      <div class="surfaces">{c.surfaces.map((s) => <SurfaceView key={`${s.x} ${s.y}`} of={s} />)}</div>
    </div>
    <div class="bands">{c.memberships.map(([before, after]) => <Chart key={after.x} name={`membership-${after.x.replaceAll(" ", "-")}`} label={`Membership of ${after.x}`} x="" y="μ" rangeY={[0, 1.05]}
      lines={[...lines(after), ...lines(before, { dash: "4 3", width: 0.8 }, ", before")]} />)}</div>
  </>;
}

export function CorrectionRoom() {
  const v = present.value, now = state.value, busy = Boolean(now?.job), ready = Boolean(now?.identify);
  const [wish, set] = useState({ epochs: 60, blanking: 1 });
  const [found, put] = useState<Correction | null>(null);
  useEffect(() => {
    let wanted = true;
    put(null);
    if (v?.corrected) correction(v.id).then((c) => wanted && put(c), () => undefined);
    return () => { wanted = false; };
  }, [v?.id]);
  useEffect(() => { if (v) command.value = v.corrected ? v.command : training(wish); }, [v?.id, wish]);
  if (!v) return <section class="room" id="correction"><h2>Learn what the physics leaves over</h2><p class="muted">Identify a model first.</p></section>;
  return (
    <section class="room" id="correction" aria-labelledby="correction-title">
      <form class="wishes" onSubmit={(event) => { event.preventDefault(); void train(wish); }}>
        <h2 id="correction-title">Learn what the physics leaves over</h2>
        <label>Epochs at most <input type="number" min={1} value={wish.epochs} onInput={(event) => set({ ...wish, epochs: Math.max(1, Math.round(Number(event.currentTarget.value)) || 1) })} /></label>
        <label>Begin left out <input type="number" min={0} step="any" value={wish.blanking} onInput={(event) => set({ ...wish, blanking: Math.max(0, Number(event.currentTarget.value) || 0) })} /> s</label>
        <button class="primary" id="train" disabled={busy || !ready}>{v.corrected ? "Train anew" : "Train"}</button>
      </form>
      <div class="content judging">{found ? <Learnt key={v.id} c={found} /> : v.corrected
        ? <p class="muted">“{v.label}” has a correction that was not learnt here.</p>
        : <p class="muted">A network of fuzzy rules (ANFIS) learns the current that “{v.label}” leaves over, of voltage, modelled current and modelled speed; it is judged on data that it has not seen. Name the missing effects first: what has a name needs no black box.</p>}</div>
    </section>
  );
}
