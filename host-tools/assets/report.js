// The signals of a report: decoding, and plots with linked axes, cursors and export.
"use strict";
(() => {
  // Points that a trace is drawn with at most; more than a screen has columns.
  const DRAWN_POINTS = 4000;
  // Samples that are written to a CSV file at full rate at most.
  const EXPORTED_SAMPLES = 2e6;
  const MISSING = -32768;
  const AXIS_WIDTH = 74;

  // ---------------------------------------------------------------- decoding

  const bytes = (base64) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));

  /** Little-endian f32 in base64; missing values become null, as uPlot wants them. */
  const floats = (base64) => {
    const view = new DataView(bytes(base64).buffer);
    return Array.from({ length: view.byteLength / 4 }, (_, k) => {
      const value = view.getFloat32(4 * k, true);
      return Number.isFinite(value) ? value : null;
    });
  };

  const inflate = async (base64) => {
    const stream = new Blob([bytes(base64)]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  };

  /** Undoes the packing of one block: low bytes, high bytes, sign in the lowest bit, first or second difference. */
  const unpack = (packed, samples, scales) => {
    let at = 0;
    return scales.map(({ offset, step }) => {
      const order = packed[at];
      const low = at + 1;
      const high = low + samples;
      at = high + samples;
      // Int16Array wraps around as the packing did.
      const codes = new Int16Array(samples);
      for (let k = 0; k < samples; k++) {
        const zigzag = packed[low + k] | (packed[high + k] << 8);
        codes[k] = (zigzag >>> 1) ^ -(zigzag & 1);
      }
      for (let pass = 0; pass < order; pass++) {
        for (let k = 1; k < samples; k++) codes[k] += codes[k - 1];
      }
      return Float64Array.from(codes, (code) => (code === MISSING ? NaN : offset + step * code));
    });
  };

  /** The smallest and the largest value of values[from, to), in the order in which they occur. */
  const extremes = (values, from, to) => {
    let low = -1;
    let high = -1;
    for (let k = from; k < to; k++) {
      const value = values[k];
      if (Number.isNaN(value)) continue;
      if (low < 0 || value < values[low]) low = k;
      if (high < 0 || value > values[high]) high = k;
    }
    if (low < 0) return [null, null];
    return low <= high ? [values[low], values[high]] : [values[high], values[low]];
  };

  const number = (value, digits = 4) => {
    if (value === null || value === undefined || !Number.isFinite(value)) return "–";
    const size = Math.abs(value);
    if (size !== 0 && (size < 1e-4 || size >= 1e6)) return value.toExponential(digits - 1);
    return String(Number(value.toPrecision(digits)));
  };

  /** A time with as many decimals as the visible span calls for. */
  const seconds = (value, span) => value.toFixed(Math.min(6, Math.max(0, 3 - Math.floor(Math.log10(span || 1)))));

  /** Decimals that tell multiples of a round step apart. */
  const decimals = (step) => Math.min(7, Math.max(0, Math.ceil(-Math.log10(step) - 1e-9)));

  // ---------------------------------------------------------------- one recording

  class Recording {
    constructor(data) {
      Object.assign(this, data);
      this.end_s = this.start_s + this.samples * this.sample_time_s;
      this.blocks = new Map();
      // Traces in the order in which a table of them is written.
      this.traces = [];
      let packed = 0;
      for (const row of this.rows) {
        const trace = (role, more) => ({ row, role, ...more });
        this.traces.push(trace("measured", { packed: packed++, wave: floats(row.measured), average: floats(row.measured_average) }));
        if (row.modelled === null) continue;
        const residual = packed++;
        this.traces.push(trace("modelled", { packed: [residual - 1, residual], wave: floats(row.modelled), average: floats(row.modelled_average) }));
        this.traces.push(trace("residual", { packed: residual, wave: floats(row.residual), average: floats(row.residual_rms) }));
        this.traces.push(trace("residual_mean", { average: floats(row.residual_mean) }));
      }
    }

    shown(view) {
      return this.traces.filter((trace) => view === "average" || trace.role !== "residual_mean");
    }

    /** First and last sample (exclusive) of a stretch of time. */
    range(from, to) {
      const index = (time) => (time - this.start_s) / this.sample_time_s;
      return [Math.max(0, Math.floor(index(from) - 1)), Math.min(this.samples, Math.ceil(index(to) + 2))];
    }

    blockNumbers(first, last) {
      const { block } = this.full_rate;
      const numbers = [];
      for (let b = Math.floor(first / block); b * block < last; b++) numbers.push(b);
      return numbers;
    }

    isStored(first, last) {
      return this.blockNumbers(first, last).every((b) => this.full_rate.blocks[b]);
    }

    /** Unpacks the stored blocks of a stretch; tells whether there was anything new. */
    async load(first, last) {
      const wanted = this.blockNumbers(first, last).filter((b) => this.full_rate.blocks[b] && !this.blocks.has(b));
      if (typeof DecompressionStream === "undefined") return false;
      await Promise.all(wanted.map(async (b) => {
        const { block, blocks, scales } = this.full_rate;
        const samples = Math.min(block, this.samples - b * block);
        const packed = unpack(await inflate(blocks[b]), samples, scales);
        this.blocks.set(b, this.traces.map(({ packed: source }) => {
          if (Array.isArray(source)) return packed[source[0]].map((value, k) => value + packed[source[1]][k]);
          return source === undefined ? null : packed[source];
        }));
      }));
      return wanted.length > 0;
    }

    /** Whether the overview alone is too coarse for a stretch. */
    wantsFullRate(first, last) {
      return this.step > 1 && (last - first) / this.step < DRAWN_POINTS / 2;
    }

    averages(from, to) {
      const { step, window_s } = this.average;
      const length = this.traces[0].average.length;
      // An average belongs to the middle of its window.
      const time = (k) => this.start_s + (k + 0.5) * step * window_s;
      return this.cut(time, length, from, to, "average", { text: step > 1 ? `extremes of every ${2 * step} averages` : "every average", exact: step === 1 });
    }

    cut(time, length, from, to, view, resolution) {
      // One point more on either side, so that lines run to the edge.
      const span = time(1) - time(0);
      const first = Math.max(0, Math.floor((from - time(0)) / span));
      const last = Math.min(length, Math.ceil((to - time(0)) / span) + 1);
      const x = [];
      for (let k = first; k < last; k++) x.push(time(k));
      return { x, y: this.shown(view).map((trace) => trace[view].slice(first, last)), resolution };
    }

    /** The signals of a stretch as they are drawn: samples, or the extremes of runs of samples. */
    waves(from, to) {
      const [first, last] = this.range(from, to);
      const overview = (k) => this.start_s + (this.step === 1 ? k : (k + 0.5) * this.step) * this.sample_time_s;
      if (!this.wantsFullRate(first, last)) {
        const exact = this.step === 1;
        const text = exact ? "every sample" : `smallest and largest of every ${2 * this.step} samples; zoom in for each sample`;
        return this.cut(overview, this.traces[0].wave.length, from, to, "wave", { text, exact });
      }
      const shown = this.shown("wave");
      const count = last - first;
      const width = count > DRAWN_POINTS ? Math.ceil((2 * count) / DRAWN_POINTS) : 1;
      const x = [];
      const y = shown.map(() => []);
      let missing = 0;
      for (const b of this.blockNumbers(first, last)) {
        const start = b * this.full_rate.block;
        const begin = Math.max(first, start);
        const end = Math.min(last, start + this.full_rate.block, this.samples);
        const block = this.blocks.get(b);
        if (!block) {
          missing += 1;
          // Points that lie in this block only: neighbours may be at full rate.
          const low = Math.ceil(begin / this.step - 0.5);
          const high = Math.min(Math.ceil(end / this.step - 0.5), shown[0].wave.length);
          for (let k = Math.max(0, low); k < high; k++) {
            x.push(overview(k));
            shown.forEach((trace, t) => y[t].push(trace.wave[k]));
          }
          continue;
        }
        for (let k = begin; k < end; k += width) {
          const stop = Math.min(end, k + width);
          const time = this.start_s + k * this.sample_time_s;
          if (width === 1) {
            x.push(time);
            shown.forEach((trace, t) => {
              const value = block[this.traces.indexOf(trace)][k - start];
              y[t].push(Number.isNaN(value) ? null : value);
            });
          } else {
            x.push(time, time + 0.5 * (stop - k) * this.sample_time_s);
            shown.forEach((trace, t) => y[t].push(...extremes(block[this.traces.indexOf(trace)], k - start, stop - start)));
          }
        }
      }
      const text = missing > 0
        ? `${width === 1 && missing < this.blockNumbers(first, last).length ? "partly " : ""}stored only as smallest and largest of every ${2 * this.step} samples here`
        : width > 1 ? `smallest and largest of every ${width} samples; zoom in for each sample` : "every sample";
      return { x, y, resolution: { text, exact: missing === 0 && width === 1 } };
    }

    /** Samples at full rate, trace by trace; null where they are not stored. */
    async samplesBetween(from, to) {
      const index = (time) => Math.round((time - this.start_s) / this.sample_time_s);
      const first = Math.max(0, index(from));
      const last = Math.min(this.samples, index(to) + 1);
      if (last <= first) return null;
      if (this.step === 1) {
        return { first, y: this.shown("wave").map((trace) => trace.wave.slice(first, last).map((v) => v ?? NaN)) };
      }
      if (!this.isStored(first, last)) return null;
      await this.load(first, last);
      const y = this.shown("wave").map(() => new Float64Array(last - first));
      for (const b of this.blockNumbers(first, last)) {
        const block = this.blocks.get(b);
        if (!block) return null;
        const start = b * this.full_rate.block;
        const begin = Math.max(first, start);
        const end = Math.min(last, start + this.full_rate.block);
        this.shown("wave").forEach((trace, t) => {
          y[t].set(block[this.traces.indexOf(trace)].subarray(begin - start, end - start), begin - first);
        });
      }
      return { first, y };
    }
  }

  const ROLE_NAMES = { measured: "measured", modelled: "model", residual: "model − measured", residual_mean: "mean of model − measured" };
  const ROLE_COLUMNS = { measured: "", modelled: "_model", residual: "_residual", residual_mean: "_residual_mean" };

  const legend = (trace, view) => {
    if (view === "wave") return ROLE_NAMES[trace.role];
    if (trace.role === "residual") return "RMS of model − measured";
    return trace.role === "residual_mean" ? ROLE_NAMES[trace.role] : `${ROLE_NAMES[trace.role]}, ${trace.row.average}`;
  };

  const column = (trace, view) => {
    const average = view === "average" && trace.role !== "residual_mean";
    return trace.row.column + ROLE_COLUMNS[trace.role] + (average ? `_${trace.role === "residual" ? "rms" : trace.row.average.toLowerCase()}` : "");
  };

  const csv = (header, columns, x, y) => {
    const lines = header.map((line) => `# ${line.replace(/[\r\n]+/g, " ")}`);
    lines.push(["t_s", ...columns].join(","));
    for (let k = 0; k < x.length; k++) {
      const cells = y.map((values) => {
        const value = values[k];
        return value === null || Number.isNaN(value) ? "" : String(Number(value.toPrecision(7)));
      });
      lines.push([String(Number(x[k].toPrecision(12))), ...cells].join(","));
    }
    return lines.join("\n") + "\n";
  };

  const save = (name, blob) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    // The browser has taken the data over by the next turn of the event loop, and some need longer.
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  };

  const make = (tag, attributes = {}, ...children) => {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.append(...children);
    return element;
  };

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const TRACE_COLOURS = { measured: "measured", modelled: "modelled", residual: "residual", residual_mean: "spread" };

  // ---------------------------------------------------------------- the plots of one recording

  class Plots {
    constructor(root) {
      this.root = root;
      this.recording = new Recording(JSON.parse(root.querySelector("script").textContent));
      this.view = "average";
      this.from = this.recording.start_s;
      this.to = this.recording.end_s;
      this.a = null;
      this.b = null;
      this.turn = 0;
      this.charts = [];
      this.toolbar();
      this.panes = this.root.appendChild(make("div", { class: "panes" }));
      this.status = make("span", { class: "resolution", role: "status" });
      const hint = "drag: zoom · double click: all · wheel (after a click): zoom · click: cursor A, shift-click: B · keys: ← → + − 0, Esc: no cursors"
        + (this.recording.uncounted_s.length ? " · grey: left out of the figures" : "");
      this.root.append(make("div", { class: "status" }, this.status, make("span", { class: "hint" }, hint)));
      this.between = this.root.appendChild(make("table", { class: "between", hidden: "" }));
      this.build();
      root.addEventListener("keydown", (event) => this.key(event));
      new ResizeObserver(() => this.resize()).observe(this.panes);
    }

    button(text, action, attributes = {}) {
      const button = make("button", { type: "button", ...attributes }, text);
      button.addEventListener("click", action);
      return button;
    }

    toolbar() {
      const { recording } = this;
      this.viewButtons = {
        average: this.button("Averages", () => this.show("average"), { "data-view": "average", title: `RMS and mean ${recording.average.label}` }),
        wave: this.button("Waveforms", () => this.show("wave"), { "data-view": "wave" }),
      };
      const bar = make("div", { class: "toolbar" }, this.viewButtons.average, this.viewButtons.wave,
        this.button("All", () => this.zoom(recording.start_s, recording.end_s), { "data-do": "all" }));
      for (const stretch of recording.stretches) {
        const label = stretch.label[0].toUpperCase() + stretch.label.slice(1);
        bar.append(this.button(label, () => {
          this.show("wave");
          this.zoom(stretch.from_s, stretch.to_s);
        }, { "data-do": stretch.label, title: `${number(stretch.from_s)} … ${number(stretch.to_s)} s` }));
      }
      bar.append(make("span", { class: "gap" }),
        this.button("CSV", () => this.exportCsv(), { "data-do": "csv", title: "The visible range as a table" }),
        this.button("PNG", () => this.exportPng(), { "data-do": "png", title: "The plots as a picture" }));
      this.root.append(bar);
    }

    /** One pane per signal and one for its residual, all of them with the same horizontal axis. */
    build() {
      this.charts.forEach(({ plot }) => plot.destroy());
      this.panes.replaceChildren();
      this.charts = [];
      const shown = this.recording.shown(this.view);
      for (const row of this.recording.rows) {
        const of = (roles) => shown.map((trace, t) => ({ trace, t })).filter(({ trace }) => trace.row === row && roles.includes(trace.role));
        const residual = of(["residual", "residual_mean"]);
        this.pane(row, of(["measured", "modelled"]), row.key === "voltage" ? 110 : 190, `${row.symbol}, ${row.unit}`, row.name);
        if (residual.length) this.pane(row, residual, 130, `${row.symbol} error, ${row.unit}`, `${row.name} error`);
      }
      for (const [view, button] of Object.entries(this.viewButtons)) button.setAttribute("aria-pressed", String(view === this.view));
      this.draw();
    }

    pane(row, traces, height, label, name) {
      const isLast = row === this.recording.rows.at(-1) && (traces[0].trace.role.startsWith("residual") || row.modelled === null);
      const title = name[0].toUpperCase() + name.slice(1);
      const names = make("div", { class: "name" }, make("b", {}, title));
      const outputs = traces.map(({ trace }) => {
        const mark = make("i");
        mark.style.background = colour(TRACE_COLOURS[trace.role]);
        const output = make("output");
        names.append(make("span", {}, mark, `${legend(trace, this.view)} `, output));
        return output;
      });
      const pane = this.panes.appendChild(make("div", { class: "pane", "data-pane": name.replace(/ /g, "-"), role: "img",
        "aria-label": `${title} of ${this.recording.name} over time: ${traces.map(({ trace }) => legend(trace, this.view)).join(", ")}` }, names));
      const text = colour("text");
      const axis = { stroke: text, grid: { stroke: colour("grid"), width: 1 }, ticks: { stroke: colour("grid"), width: 1, size: 5 } };
      const font = "12px system-ui, sans-serif";
      const plot = new uPlot({
        width: Math.max(280, this.panes.clientWidth),
        height: height + (isLast ? 34 : 0),
        padding: [6, 20, 0, 0],
        legend: { show: false },
        scales: { x: { time: false, range: () => [this.from, this.to] }, y: { range: (_, low, high) => this.rangeOf(low, high) } },
        cursor: {
          sync: { key: this.root.id, setSeries: false },
          drag: { x: true, y: false, setScale: false, dist: 4 },
          bind: { dblclick: () => () => null },
          points: { size: 6 },
        },
        axes: [
          { ...axis, font, labelFont: font, size: isLast ? 26 : 8, space: 80, label: isLast ? "time, s" : undefined, labelSize: 20,
            values: (_, ticks, axisIndex, space, step) => ticks.map((tick) => (isLast ? tick.toFixed(decimals(step)) : "")) },
          { ...axis, font, labelFont: font, size: AXIS_WIDTH - 20, space: 28, label, labelSize: 20, values: (_, ticks) => ticks.map((tick) => number(tick, 5)) },
        ],
        series: [{}, ...traces.map(({ trace }) => ({
          label: legend(trace, this.view), stroke: colour(TRACE_COLOURS[trace.role]), width: 1.25, points: { show: false }, spanGaps: false,
          dash: trace.role === "modelled" && this.view === "average" ? [6, 3] : undefined,
        }))],
        hooks: {
          setSelect: [(u) => {
            if (u.select.width < 4) return;
            const ends = [u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x")];
            u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
            this.zoom(...ends);
          }],
          setCursor: [(u) => {
            outputs.forEach((output, k) => {
              const value = u.cursor.idx === null || u.cursor.idx === undefined ? null : u.data[k + 1][u.cursor.idx];
              output.textContent = u.cursor.left >= 0 ? `${number(value)} ${row.unit}` : "";
            });
          }],
          drawClear: [(u) => this.shade(u)],
          draw: [(u) => this.marks(u, traces[0].trace.role.startsWith("residual"))],
        },
      }, [[0], ...traces.map(() => [null])], pane);
      this.listen(plot);
      this.charts.push({ plot, traces, title, names, unit: row.unit });
    }

    rangeOf(low, high) {
      if (!Number.isFinite(low) || !Number.isFinite(high)) return [-1, 1];
      const pad = high > low ? 0.06 * (high - low) : Math.abs(high) * 0.1 || 1;
      return [low - pad, high + pad];
    }

    listen(plot) {
      const { over } = plot;
      let pressed = null;
      let before = null;
      over.addEventListener("pointerdown", (event) => {
        this.root.focus({ preventScroll: true });
        pressed = [event.clientX, event.clientY];
      });
      over.addEventListener("click", (event) => {
        const moved = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 3;
        // The second click of a double click is no cursor.
        if (moved || event.detail > 1) return;
        before = [this.a, this.b];
        const time = plot.posToVal(event.clientX - over.getBoundingClientRect().left, "x");
        if (event.shiftKey) this.b = time;
        else this.a = time;
        this.measure();
      });
      over.addEventListener("dblclick", () => {
        if (before) [this.a, this.b] = before;
        this.measure();
        this.zoom(this.recording.start_s, this.recording.end_s);
      });
      over.addEventListener("wheel", (event) => {
        // Without a click first, the wheel scrolls the page.
        if (!event.ctrlKey && !this.root.contains(document.activeElement)) return;
        event.preventDefault();
        const centre = plot.posToVal(event.clientX - over.getBoundingClientRect().left, "x");
        this.scale(event.deltaY < 0 ? 0.75 : 1 / 0.75, centre);
      }, { passive: false });
    }

    key(event) {
      if (event.ctrlKey || event.altKey || event.metaKey || event.target.tagName === "BUTTON" && event.key === " ") return;
      const span = this.to - this.from;
      const actions = {
        ArrowLeft: () => this.pan(-0.2 * span),
        ArrowRight: () => this.pan(0.2 * span),
        "+": () => this.scale(0.5),
        "=": () => this.scale(0.5),
        "-": () => this.scale(2),
        0: () => this.zoom(this.recording.start_s, this.recording.end_s),
        Escape: () => {
          this.a = this.b = null;
          this.measure();
        },
      };
      if (!actions[event.key]) return;
      event.preventDefault();
      actions[event.key]();
    }

    pan(by) {
      const { start_s, end_s } = this.recording;
      const shift = Math.max(start_s - this.from, Math.min(end_s - this.to, by));
      this.zoom(this.from + shift, this.to + shift);
    }

    scale(factor, centre = (this.from + this.to) / 2) {
      this.zoom(centre + (this.from - centre) * factor, centre + (this.to - centre) * factor);
    }

    zoom(from, to) {
      const { start_s, end_s, sample_time_s } = this.recording;
      // Ten samples are the shortest stretch that makes sense.
      const shortest = Math.min(10 * sample_time_s, end_s - start_s);
      const middle = (from + to) / 2;
      if (to - from < shortest) [from, to] = [middle - shortest / 2, middle + shortest / 2];
      this.from = Math.max(start_s, Math.min(from, end_s - shortest));
      this.to = Math.min(end_s, Math.max(to, this.from + shortest));
      this.draw();
    }

    show(view) {
      if (view === this.view) return;
      this.view = view;
      this.build();
    }

    async draw() {
      const { recording } = this;
      const turn = ++this.turn;
      this.put();
      const [first, last] = recording.range(this.from, this.to);
      if (this.view === "wave" && recording.wantsFullRate(first, last) && await recording.load(first, last) && turn === this.turn) this.put();
      this.root.dataset.from = this.from;
      this.root.dataset.to = this.to;
      this.root.dataset.drawn = turn;
    }

    put() {
      const { x, y, resolution } = this.view === "average" ? this.recording.averages(this.from, this.to) : this.recording.waves(this.from, this.to);
      this.visible = { x, y, resolution };
      for (const { plot, traces } of this.charts) plot.setData([x, ...traces.map(({ t }) => y[t])]);
      const span = this.to - this.from;
      const kind = this.view === "average" ? `${resolution.text}, ${this.recording.average.label}` : resolution.text;
      this.status.textContent = `${seconds(this.from, span)} … ${seconds(this.to, span)} s: ${kind}`;
      this.root.dataset.exact = resolution.exact;
    }

    resize() {
      const width = Math.max(280, this.panes.clientWidth);
      for (const { plot } of this.charts) if (plot.width !== width) plot.setSize({ width, height: plot.height });
    }

    /** Greys out what does not count in the figures. */
    shade(u) {
      const { ctx, bbox } = u;
      ctx.save();
      ctx.fillStyle = colour("uncounted");
      for (const [from, to] of this.recording.uncounted_s) {
        const left = Math.max(bbox.left, u.valToPos(from, "x", true));
        const right = Math.min(bbox.left + bbox.width, u.valToPos(to, "x", true));
        if (right > left) ctx.fillRect(left, bbox.top, Math.max(1, right - left), bbox.height);
      }
      ctx.restore();
    }

    marks(u, withZero) {
      const { ctx, bbox } = u;
      const ratio = devicePixelRatio;
      ctx.save();
      ctx.lineWidth = ratio;
      if (withZero) {
        const y = u.valToPos(0, "y", true);
        if (y > bbox.top && y < bbox.top + bbox.height) {
          ctx.strokeStyle = colour("muted");
          ctx.setLineDash([3 * ratio, 3 * ratio]);
          ctx.beginPath();
          ctx.moveTo(bbox.left, y);
          ctx.lineTo(bbox.left + bbox.width, y);
          ctx.stroke();
          ctx.setLineDash([]);
        }
      }
      for (const name of ["a", "b"]) {
        if (this[name] === null || this[name] < this.from || this[name] > this.to) continue;
        const x = u.valToPos(this[name], "x", true);
        ctx.strokeStyle = ctx.fillStyle = colour(name);
        ctx.lineWidth = 1.5 * ratio;
        ctx.beginPath();
        ctx.moveTo(x, bbox.top);
        ctx.lineTo(x, bbox.top + bbox.height);
        ctx.stroke();
        ctx.font = `${12 * ratio}px system-ui, sans-serif`;
        ctx.textAlign = "left";
        ctx.fillText(name.toUpperCase(), x + 4 * ratio, bbox.top + 12 * ratio);
      }
      ctx.restore();
    }

    /** The table of the two cursors: values at A and B, and difference, mean and RMS between them. */
    async measure() {
      this.charts.forEach(({ plot }) => plot.redraw(false));
      this.between.hidden = this.a === null && this.b === null;
      const both = this.a !== null && this.b !== null;
      const low = both ? Math.min(this.a, this.b) : this.a ?? this.b;
      const high = both ? Math.max(this.a, this.b) : low;
      if (low === null) return;
      const asked = [this.a, this.b];
      const at = async (time) => time === null ? null : (await this.recording.samplesBetween(time, time))?.y.map((values) => values[0]) ?? null;
      const [atA, atB, within] = [await at(this.a), await at(this.b), both ? await this.recording.samplesBetween(low, high) : null];
      if (asked[0] !== this.a || asked[1] !== this.b) return;
      const cell = (text) => make("td", { class: "number" }, text);
      const head = make("tr", {}, ...["", "at A", "at B", "B − A", "mean", "RMS"].map((text) => make("th", { scope: "col" }, text)));
      const step = Math.max(this.recording.sample_time_s, (this.to - this.from) / 1000);
      const time = make("tr", {}, make("th", { scope: "row" }, "time, s"), cell(this.a === null ? "–" : seconds(this.a, step * 100)), cell(this.b === null ? "–" : seconds(this.b, step * 100)));
      const apart = both ? this.b - this.a : null;
      time.append(cell(both ? `Δt ${number(apart)} s` : "–"), make("td", { class: "number", colspan: "2" }, both && apart !== 0 ? `1/Δt ${number(1 / Math.abs(apart))} Hz` : "–"));
      const rows = this.recording.shown("wave").map((trace, t) => {
        const values = within?.y[t].filter((v) => Number.isFinite(v));
        const mean = values?.length ? values.reduce((sum, v) => sum + v, 0) / values.length : null;
        const rms = values?.length ? Math.sqrt(values.reduce((sum, v) => sum + v * v, 0) / values.length) : null;
        return make("tr", { "data-trace": trace.row.column + ROLE_COLUMNS[trace.role] },
          make("th", { scope: "row" }, `${trace.row.symbol} ${ROLE_NAMES[trace.role]}, ${trace.row.unit}`),
          cell(number(atA?.[t])), cell(number(atB?.[t])), cell(number(atA && atB ? atB[t] - atA[t] : null)), cell(number(mean)), cell(number(rms)));
      });
      const caption = make("caption", {}, both && !within ? "Between the cursors not every sample is stored; mean and RMS are left out." : "Cursors");
      this.between.replaceChildren(caption, make("thead", {}, head), make("tbody", {}, time, ...rows));
    }

    fileName(extension) {
      const stem = this.recording.name.split(/[\\/]/).at(-1).replace(/\.[^.]*$/, "").replace(/[^\p{L}\p{N}_-]+/gu, "_") || "recording";
      return `${stem}_${seconds(this.from, 0.1)}-${seconds(this.to, 0.1)}s.${extension}`;
    }

    /** The visible range, at full rate where every sample of it is stored. */
    async exportCsv() {
      const { recording } = this;
      const shown = recording.shown(this.view);
      let { x, y, resolution: { text } } = this.visible;
      const samples = (this.to - this.from) / recording.sample_time_s;
      if (this.view === "wave" && samples <= EXPORTED_SAMPLES) {
        const full = await recording.samplesBetween(this.from, this.to);
        if (full) {
          ({ y } = full);
          x = Array.from(y[0], (_, k) => recording.start_s + (full.first + k) * recording.sample_time_s);
          text = "every sample";
        }
      }
      const header = [`recording: ${recording.name}`, `resolution: ${this.view === "average" ? `${text}, ${recording.average.label}` : text}`];
      save(this.fileName("csv"), new Blob([csv(header, shown.map((trace) => column(trace, this.view)), x, y)], { type: "text/csv" }));
    }

    /** All panes in one picture; what the page writes around them (title, legend) is drawn in. */
    exportPng() {
      const ratio = devicePixelRatio;
      const line = 20 * ratio;
      const canvas = document.createElement("canvas");
      canvas.width = this.charts[0].plot.ctx.canvas.width;
      canvas.height = 2.8 * line + this.charts.reduce((sum, { plot }) => sum + plot.ctx.canvas.height + line, 0);
      const ctx = canvas.getContext("2d");
      ctx.fillStyle = colour("ground");
      ctx.fillRect(0, 0, canvas.width, canvas.height);
      const font = (size, weight = "") => `${weight} ${size * ratio}px system-ui, sans-serif`;
      const left = AXIS_WIDTH * ratio;
      ctx.fillStyle = colour("text");
      ctx.font = font(15, "600");
      ctx.fillText(this.recording.name, left, 1.1 * line, canvas.width - left);
      ctx.font = font(12);
      ctx.fillStyle = colour("muted");
      ctx.fillText(this.status.textContent, left, 2.1 * line, canvas.width - left);
      let top = 2.8 * line;
      for (const { plot, traces, title, unit } of this.charts) {
        let x = left;
        const write = (text, style, weight) => {
          ctx.font = font(12, weight);
          ctx.fillStyle = style;
          ctx.fillText(text, x, top + 0.7 * line);
          x += ctx.measureText(text).width + 10 * ratio;
        };
        write(`${title}, ${unit}`, colour("text"), "600");
        for (const { trace } of traces) {
          ctx.fillStyle = colour(TRACE_COLOURS[trace.role]);
          ctx.fillRect(x, top + 0.45 * line, 16 * ratio, 3 * ratio);
          x += 22 * ratio;
          write(legend(trace, this.view), colour("text"));
        }
        ctx.drawImage(plot.ctx.canvas, 0, top + line);
        top += line + plot.ctx.canvas.height;
      }
      canvas.toBlob((blob) => save(this.fileName("png"), blob));
    }
  }

  // ---------------------------------------------------------------- the page

  const tip = document.getElementById("tip");
  document.addEventListener("pointermove", (event) => {
    const text = event.target instanceof Element ? event.target.getAttribute("data-tip") : null;
    tip.hidden = !text;
    if (!text) return;
    if (tip.textContent !== text) tip.textContent = text;
    // To the left of the pointer where the right edge is near.
    const width = tip.offsetWidth;
    tip.style.left = `${event.clientX + 16 + width > innerWidth ? Math.max(4, event.clientX - 12 - width) : event.clientX + 16}px`;
    tip.style.top = `${Math.min(event.clientY + 16, innerHeight - tip.offsetHeight - 4)}px`;
  });

  const all = [...document.querySelectorAll(".signals")].map((root) => new Plots(root));
  const rebuild = () => all.forEach((plots) => plots.build());
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", rebuild);
  // On paper the ground is white.
  addEventListener("beforeprint", () => {
    document.documentElement.dataset.theme = "light";
    rebuild();
  });
  addEventListener("afterprint", () => {
    delete document.documentElement.dataset.theme;
    rebuild();
  });
})();
