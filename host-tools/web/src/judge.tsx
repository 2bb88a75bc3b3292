// Motors judged: pass or fail between the limits of healthy ones, where each lies among them, and what may be wrong.
import { useEffect, useRef, useState } from "preact/hooks";
import type { Judged, Place, Test } from "./api";
import { Chart } from "./chart";
import { percent, rounded } from "./format";
import { judged, state } from "./server";
import { command, present } from "./view";
import { calibrate, judge, openStation } from "./work";

const MARKS: Record<string, [string, string]> = { pass: ["fine", "✓"], fail: ["stop", "✕"], "cannot judge": ["warning", "?"] };

function Mark({ verdict }: { verdict: string }) {
  const [kind, sign] = MARKS[verdict] ?? ["warning", "?"];
  return <span class={`mark ${kind}`} aria-hidden="true">{sign}</span>;
}

/** Odds in words: a number of many digits says no more than that. */
const odds = (x: number | null): string => (x == null ? "–" : x <= 1.0005 ? "likeliest" : x > 1e4 ? "1 : > 10 000" : `1 : ${rounded(x, 2)}`);

/** A figure on its way from what is usual to its limits. */
function PlaceView({ p }: { p: Place }) {
  // The band takes the middle half; what is further out than twice the limit stands at the end.
  const centre = p.band.low == null ? 0 : (p.band.low + p.band.high) / 2, side = p.value < centre ? -1 : 1;
  const share = p.band.low == null ? Math.min(2, p.ratio) / 2 : 0.5 + (side * Math.min(2, p.ratio)) / 4;
  const [from, to] = p.band.low == null ? [0, 50] : [25, 75];
  return (
    <tr class={p.ratio > 1 ? "beyond" : ""}><th scope="row">{p.name}</th><td>{rounded(p.value, 3)} {p.unit}</td>
      <td class="strip" title={`Healthy motors: ${p.band.low == null ? "up to" : `${rounded(p.band.low, 3)} to`} ${rounded(p.band.high, 3)} ${p.unit}`}><i style={{ left: `${from}%`, width: `${to - from}%` }} /><b style={{ left: `${100 * share}%` }} /></td>
      <td>{percent(p.ratio)}</td></tr>
  );
}

function Details({ t }: { t: Test }) {
  const times: [number, number] = [Math.min(...t.courses.flatMap((c) => c.t_s.slice(0, 1))), Math.max(...t.courses.flatMap((c) => c.t_s.slice(-1)))];
  const spans = t.alarms.map((a) => ({ from: a.from_s, to: a.to_s, title: `${a.cause}, ${rounded(a.ratio, 2)} times the limit` }));
  return <>
    <div class="told" tabIndex={0} role="region" aria-label="Verdict">
      <h3 data-verdict={t.verdict}><Mark verdict={t.verdict} /> {t.serial ? `Motor ${t.serial} (${t.name})` : t.name}: {t.verdict}, {t.periods[0]} of {t.periods[1]} periods judged</h3>
      {t.reasons.map((r) => <p class="note warning">{r}</p>)}
      {t.alarms.map((a) => <p class="note stop">From {rounded(a.from_s, 4)} to {rounded(a.to_s, 4)} s: {a.kind}, {a.cause} at {rounded(a.ratio, 3)} times the limit{a.suspect ? `; ${a.suspect}` : ""}</p>)}
      {t.hypotheses.length ? <table id="hypotheses"><thead><tr><th scope="col">What may be wrong</th><th scope="col">Odds</th><th scope="col">Over the limit</th><th scope="col">Explains</th></tr></thead>
        <tbody>{t.hypotheses.slice(0, 8).map((h) => <tr class={h.as_likely ? "" : "unknown"}><th scope="row">{h.text}{h.look_at ? <small>{h.look_at}</small> : null}</th><td>{odds(h.odds)}</td><td>{h.ratio == null ? "–" : `${rounded(h.ratio, 3)} ×`}</td><td>{percent(Math.min(1, h.explains))}</td></tr>)}</tbody></table> : null}
      {t.places.length ? <><h3>Among healthy motors</h3><table id="places"><thead><tr><th scope="col">Figure</th><th scope="col">This motor</th><th scope="col">Band of healthy ones</th><th scope="col">To the limit</th></tr></thead><tbody>{t.places.map((p) => <PlaceView p={p} />)}</tbody></table></> : null}
    </div>
    <div class="bands" aria-label="What is watched over the time of the test, and the band of healthy motors">
      {t.courses.map((c, k) => <Chart key={c.name} name={`course-${k}`} file={c.name.replaceAll(" ", "_")} label={c.name} x="s" y={c.unit} rangeX={times} spans={spans} bottom={k === t.courses.length - 1}
        band={c.band ? { low: c.band.low, high: c.band.high } : undefined} lines={[{ name: c.name, colour: "--residual", xs: c.t_s, ys: c.values }]} />)}
    </div>
  </>;
}

/** The motors in the order in which they were judged: how far each was on its way to a limit. */
function Trend({ tests }: { tests: Test[] }) {
  const names = ["deviation of the current", "deviation of the speed"];
  const xs = tests.map((_, k) => k + 1);
  const of = (name: string) => tests.map((t) => t.places.find((p) => p.name === name)).map((p) => (p ? (p.band.low == null ? p.ratio : Math.sign(p.value - (p.band.low + p.band.high) / 2) * p.ratio) : null));
  return <Chart name="trend" label="Trend" x="motor" y="of the way to the limit" band={{ low: -1, high: 1 }} rangeX={[0.5, tests.length + 0.5]}
    lines={names.map((name, k) => ({ name, colour: k ? "--modelled" : "--measured", xs, ys: of(name), width: 3, as: "dots" as const }))} />;
}

export function JudgeRoom() {
  const now = state.value, busy = Boolean(now?.job), station = now?.station;
  const usable = now?.recordings.filter((r) => !r.unusable) ?? [];
  const [left, leave] = useState<Set<number>>(new Set());
  const [answer, set] = useState<Judged | null>(null), [shown, show] = useState(0);
  const input = useRef<HTMLInputElement>(null);
  const number = now?.judged;
  useEffect(() => {
    let wanted = true;
    if (number == null) set(null);
    else judged().then((found) => { if (wanted) { set(found); show(0); command.value = found.command; } }, () => wanted && set(null));
    return () => { wanted = false; };
  }, [number, station?.name]);
  const ids = usable.filter((r) => !left.has(r.id)).map((r) => r.id);
  const test = answer?.tests[shown];
  return (
    <section class="room" id="judge" aria-labelledby="judge-title">
      <div class="wishes">
        <h2 id="judge-title">Pass or fail?</h2>
        <span class="station" title={station?.knows_lot ? "It knows the balances of its lot, and names faults by them" : ""}>{station ? <><b>{station.name}</b> <span class="muted">{station.motors || station.runs} healthy {station.motors ? "motors" : "runs"}; holds {percent(station.holds[0])} of them, confidence {percent(station.holds[1])}</span></> : <span class="muted">No limits yet.</span>}</span>
        <button class="small" disabled={busy} title="A model file with limits, from greyrig calibrate" onClick={() => input.current?.click()}>Open a station…</button>
        <input id="station-file" ref={input} type="file" accept=".toml" hidden aria-label="Station file" onChange={async (event) => { const target = event.currentTarget, file = target.files?.[0]; if (file) await openStation(file); target.value = ""; }} />
        <button class="small" id="calibrate" disabled={busy || !present.value || !ids.length} title={`Learn the limits of “${present.value?.label ?? ""}” from the ticked recordings, of healthy motors`} onClick={() => calibrate(ids)}>Learn from those ticked</button>
        <button class="primary" id="judge-begin" disabled={busy || !station || !ids.length} onClick={() => judge(ids)}>Judge</button>
      </div>
      <div class="content judging">
        <div class="motors">
          <fieldset><legend>A motor each</legend>
            {usable.map((r) => <label><input type="checkbox" checked={!left.has(r.id)} onChange={() => { const next = new Set(left); if (!next.delete(r.id)) next.add(r.id); leave(next); }} /> {r.name}</label>)}
          </fieldset>
          {answer ? <ul id="verdicts" aria-label="Verdicts">{answer.tests.map((t, k) => <li class={k === shown ? "chosen" : ""} data-verdict={t.verdict}><button class="name" aria-pressed={k === shown} aria-label={`${t.serial ?? t.name}: ${t.verdict}`} title={`${t.serial ?? t.name}: ${t.verdict}`} onClick={() => show(k)}><Mark verdict={t.verdict} /> {t.serial ?? t.name}</button></li>)}</ul> : null}
          {answer && answer.tests.length > 1 ? <Trend tests={answer.tests} /> : null}
        </div>
        {test ? <Details key={`${answer?.number} ${shown}`} t={test} /> : <p class="muted">A station is a model with the limits that healthy motors keep: open one that <code>greyrig calibrate</code> has made, or learn the limits from recordings of ten healthy motors or more.</p>}
      </div>
    </section>
  );
}
