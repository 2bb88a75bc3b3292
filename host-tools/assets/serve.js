// The page of `greyrig serve`: asks for the state, shows it, and asks for what the user wants done.
"use strict";

const find = (selector) => document.querySelector(selector);
// Milliseconds between looks at what is being done.
const LOOK = 250;
let shown = "", shownReport = "";

const percent = (x) => x == null ? "–" : x >= 0.1 ? `${(100 * x).toFixed(1)} %` : x >= 0.001 ? `${(100 * x).toFixed(2)} %` : `${(100 * x).toPrecision(2)} %`;
const rounded = (x) => x == null ? "–" : x !== 0 && Math.abs(x) < 1e-3 ? x.toExponential(3) : Number(x.toPrecision(5)).toString();

function element(name, text, properties = {}) {
  const made = Object.assign(document.createElement(name), properties);
  if (text != null) made.textContent = text;
  return made;
}

function row(cells, head = true) {
  const made = element("tr");
  cells.forEach((cell, k) => {
    const cellMade = element(k === 0 && head ? "th" : "td");
    if (cell instanceof Node) cellMade.append(cell);
    else if (Array.isArray(cell)) { cellMade.className = "number"; cellMade.textContent = cell[0]; }
    else cellMade.textContent = cell ?? "";
    if (cellMade.nodeName === "TH") cellMade.scope = "row";
    made.append(cellMade);
  });
  return made;
}

function say(error) {
  find("#error").textContent = error ?? "";
  find("#error").hidden = !error;
}

async function post(path, body) {
  say(null);
  const answer = await fetch(path, { method: "POST", body });
  if (!answer.ok) say((await answer.text()).trim());
  await refresh();
}

function button(text, title, action) {
  const made = element("button", text, { type: "button", title });
  made.addEventListener("click", action);
  return made;
}

const adding = (id) => button(`Add ${id}`, `Identify again with ${id}, and judge it on data held out`, () => post(`add?effect=${encodeURIComponent(id)}`));

function finding(f) {
  const when = f.from_s == null ? "" : ` (${rounded(f.from_s)} … ${rounded(f.to_s)} s)`;
  const mend = f.remedy ? `; ${f.remedy}` : "";
  return element("div", `${f.severity}: ${f.text}${when}${mend}`, { className: f.severity === "info" ? "key" : `note ${f.severity}` });
}

function showRecordings(state) {
  const items = state.recordings.map((r, k) => {
    const item = element("li", `${r.name}: ${rounded(r.seconds)} s, ${r.channels.join(", ")} every ${rounded(1e6 * r.sample_time_s)} µs `);
    item.append(button("Remove", "Go on without this recording; its file stays", () => post(`remove?recording=${k}`)));
    r.warnings.forEach((w) => item.append(element("div", w, { className: "key" })));
    state.data_findings.filter((f) => f.recording === r.name).forEach((f) => item.append(finding(f)));
    return item;
  });
  find("#recordings").replaceChildren(...(items.length ? items : [element("li", "none yet")]));
}

function judgement(version) {
  if (version.accepted == null) return "";
  return version.accepted ? "accepted: the error falls on data held out" : "not accepted: the error does not fall on data held out";
}

function showVersions(state) {
  const rows = state.versions.map((v, k) => {
    const values = ["current", "speed"].flatMap((signal) => [v.held_out, v.noise_floor, v.training].map((e) => [percent(e[signal])]));
    const go = k === state.present ? "present" : button("Go to", "Make this version the present one", () => post(`go?version=${k}`));
    const of = v.recordings === state.recordings.length ? "" : ` (of ${v.recordings} recording${v.recordings === 1 ? "" : "s"})`;
    const made = row([v.label + of, ...values, judgement(v), go]);
    made.classList.toggle("present", k === state.present);
    return made;
  });
  find("#versions tbody").replaceChildren(...rows);
  const present = state.versions[state.present];
  for (const part of ["#versions", "#falling", "#parameters", "#comparison", "#model"]) find(part).hidden = !present;
  if (!present) return;
  const interval = (p) => p.ci95 ? `${rounded(p.ci95[0])} … ${rounded(p.ci95[1])}` : "–";
  find("#parameters tbody").replaceChildren(...present.parameters.map((p) => row([p.name, [rounded(p.value)], [interval(p)], p.unit])));
  find("#notes").replaceChildren(...present.notes.map((n) => element("li", n)));
  const key = `${state.present}-${state.versions.length}-${present.label}-${state.recordings.length}-${present.held_out.current}`;
  if (key !== shownReport) {
    shownReport = key;
    find("#falling img").src = `falling.svg?${encodeURIComponent(key)}`;
    find("#comparison iframe").classList.add("loading");
    find("#comparison iframe").src = `report/${state.present}?${encodeURIComponent(key)}`;
  }
}

function showVerdict(state) {
  const diagnosis = state.versions[state.present]?.diagnosis;
  find("#verdict").hidden = !diagnosis;
  if (!diagnosis) return;
  const { verdict } = diagnosis;
  find("#verdict-title").textContent = diagnosis.headline;
  find("#odds").textContent = diagnosis.odds ? `Odds: ${diagnosis.odds}` : "";
  find("#odds").hidden = !diagnosis.odds;
  find("#add").replaceChildren(...verdict.effects.map(adding));
  find("#why").replaceChildren(...verdict.text.split("\n").map((line) => element("p", line)));
  find("#next").textContent = verdict.next_experiment ? `Next recording: ${verdict.next_experiment}` : "";
  find("#next").hidden = !verdict.next_experiment;
  find("#candidates tbody").replaceChildren(...diagnosis.candidates.map((c) => row([
    [String(c.step)], c.effect, [`${(100 * Math.max(0, c.held_out_gain)).toFixed(1)} %`],
    [percent(c.esr_after.current)], [percent(c.esr_after.speed)], c.objection, adding(c.effect),
  ], false)));
}

function show(state) {
  const { job } = state;
  find("#job").textContent = job ? `${job.what}… ${job.doing}${job.fraction === null ? ` (step ${job.steps})` : ` ${Math.round(100 * job.fraction)} %`}` : "";
  find("#stop").hidden = !job;
  if (state.error) say(state.error);
  const text = JSON.stringify({ ...state, job: Boolean(job) });
  if (text === shown) return;
  shown = text;
  showRecordings(state);
  showVersions(state);
  showVerdict(state);
  const none = !state.versions.length;
  const disabled = {
    "#identify": !state.recordings.length, "#diagnose": none,
    "#undo": state.present === 0, "#redo": none || state.present + 1 >= state.versions.length,
  };
  for (const [part, is] of Object.entries(disabled)) find(part).disabled = is || Boolean(job);
  for (const other of document.querySelectorAll("#recordings button, #add button, #candidates button, #versions button")) other.disabled = Boolean(job);
  find("#undo").onclick = () => post(`go?version=${state.present - 1}`);
  find("#redo").onclick = () => post(`go?version=${state.present + 1}`);
}

async function refresh() {
  let state;
  try {
    state = await (await fetch("state")).json();
  } catch {
    say("greyrig serve has ended; start it again and reload this page");
    return;
  }
  show(state);
  if (state.job) setTimeout(refresh, LOOK);
}

find("#identify").addEventListener("click", () => post("identify"));
find("#stop").addEventListener("click", () => post("stop"));
find("#diagnose").addEventListener("click", () => post("diagnose"));
async function addRecordings(files) {
  for (const file of files) await post(`recordings?name=${encodeURIComponent(file.name)}`, file);
}

find("#comparison iframe").addEventListener("load", (event) => event.target.classList.remove("loading"));
find("#files").addEventListener("change", async (event) => {
  await addRecordings(event.target.files);
  event.target.value = "";
});
document.addEventListener("dragover", (event) => event.preventDefault());
document.addEventListener("drop", (event) => {
  event.preventDefault();
  addRecordings(event.dataTransfer.files);
});
refresh();
