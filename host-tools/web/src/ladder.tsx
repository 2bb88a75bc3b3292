// The error from the base model to the present version, on a logarithmic scale, with the noise floor.
import { useEffect, useRef, useState } from "preact/hooks";
import type { Figures, Version } from "./api";
import { columns as asTable, save, saveDrawing } from "./exports";
import { percent } from "./format";
import { state } from "./server";
import { hovered, present } from "./view";
import { ladder, SIGNALS, tried } from "./versions";
import { go } from "./work";

type Of = (typeof SIGNALS)[number][0];

export function Ladder() {
  const box = useRef<HTMLDivElement>(null), svg = useRef<SVGSVGElement>(null);
  const [[width, height], set] = useState([300, 150]);
  useEffect(() => {
    const watch = new ResizeObserver(([entry]) => { if (entry) set([entry.contentRect.width, entry.contentRect.height]); });
    if (box.current) watch.observe(box.current);
    return () => watch.disconnect();
  }, [Boolean(present.value)]);
  const v = present.value;
  if (!v) return null;
  const steps = ladder(state.value?.versions ?? [], v);
  const candidate = tried(v).find((c) => c.effect === hovered.value);
  const columns: { label: string; error: Figures; tried: boolean; version: Version | undefined }[] =
    steps.map((s) => ({ label: s.label, error: s.held_out, tried: false, version: s }));
  if (candidate?.predicted) columns.push({ label: `+ ${candidate.effect}?`, error: candidate.predicted, tried: true, version: undefined });
  const signals = SIGNALS.map(([of]) => of).filter((of) => columns.some((c) => c.error[of] != null));
  const all = signals.flatMap((of) => [...columns.map((c) => c.error[of]), v.floor[of]]).filter((x): x is number => x != null && x > 0);
  if (!all.length) return <section id="ladder"><p class="muted">There is no error to show: nothing stands out of the noise.</p></section>;
  const low = Math.floor(Math.log10(Math.min(...all)) - 0.05), high = Math.ceil(Math.log10(Math.max(...all)) + 0.02);
  const left = 46, bottom = 30, top = 6, right = 6, inner = Math.max(20, width - left - right), tall = Math.max(20, height - bottom - top);
  const y = (x: number) => top + tall * (1 - (Math.log10(x) - low) / Math.max(1, high - low));
  const each = inner / columns.length;
  const x = (k: number) => left + each * (k + 0.5);
  const path = (of: Of) => columns.map((c, k) => [k, c.error[of]] as const).filter(([, e]) => e != null && e > 0).map(([k, e], n) => `${n ? "L" : "M"}${x(k)} ${y(e!)}`).join("");
  const places = columns.map((_, k) => k + 1);
  const decades = Array.from({ length: high - low + 1 }, (_, k) => 10 ** (low + k));
  return (
    <section id="ladder" aria-label="Error of the versions on data held out">
      <div class="switch"><b title="Error-to-signal ratio in free run, on data that the fit of the training data has not seen">Held-out error</b> {signals.map((of) => <span class="key" title={of}><i class={of} />{SIGNALS.find(([name]) => name === of)?.[1] ?? of}</span>)}<span class="key"><i class="floor" />floor</span><span class="grow" />
        <span class="saves">{["svg", "png"].map((ending) => <button class="small bare" title={`Save the ladder as ${ending.toUpperCase()}`} onClick={() => svg.current && saveDrawing(svg.current, `ladder.${ending}`)}>{ending.toUpperCase()}</button>)}
          <button class="small bare" title="Save the errors as CSV" onClick={() => save("ladder.csv", new Blob([asTable("version", signals.map((of) => ({ name: `${of} (${columns.map((c) => c.label).join("; ")})`, xs: places, ys: columns.map((c) => c.error[of]) })))], { type: "text/csv" }))}>CSV</button></span></div>
      <div class="box" ref={box}>
        <svg ref={svg} width={width} height={height} role="img" aria-label={columns.map((c) => `${c.label}: ${signals.map((of) => `${of} ${percent(c.error[of])}`).join(", ")}`).join("; ")}>
          {decades.map((d) => <g><line class="grid" x1={left} x2={width - right} y1={y(d)} y2={y(d)} /><text x={left - 4} y={y(d) + 3} text-anchor="end">{Number((100 * d).toPrecision(2))} %</text></g>)}
          {signals.map((of) => <g class={of}>
            {v.floor[of] ? <line class="floor" x1={left} x2={width - right} y1={y(v.floor[of]!)} y2={y(v.floor[of]!)} /> : null}
            <path d={path(of)} />
            {columns.map((c, k) => (c.error[of] ? <g>
              {of === "current" ? <circle class={c.tried ? "tried" : ""} cx={x(k)} cy={y(c.error[of]!)} r={4} /> : <rect class={c.tried ? "tried" : ""} x={x(k) - 3.5} y={y(c.error[of]!) - 3.5} width={7} height={7} />}
              <text class="value" x={x(k) + 7} y={y(c.error[of]!) + 3}>{percent(c.error[of])}</text></g> : null))}
          </g>)}
          {columns.map((c, k) => <text class="label" x={x(k)} y={height - 12} text-anchor="middle" onClick={() => c.version && c.version.id !== v.id && go(c.version)}>{c.label.length * 6.2 > each ? `${c.label.slice(0, Math.max(3, Math.floor(each / 6.2) - 1))}…` : c.label}<title>{c.label}</title></text>)}
        </svg>
      </div>
    </section>
  );
}
