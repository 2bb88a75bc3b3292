// Where things are in a plot.

/** Round numbers between two, some `count` of them. */
export function ticks(low: number, high: number, count: number): number[] {
  if (!(high > low) || !Number.isFinite(high - low)) return [low];
  const rough = (high - low) / Math.max(1, count), size = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * size).find((s) => s >= rough * 0.999) ?? 10 * size;
  const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, k) => Number(((first + k) * step).toPrecision(12)));
}

/** Powers of ten between two numbers, not more than `count`. */
export function decades(low: number, high: number, count: number): number[] {
  const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
  if (last - first < 2) {
    const fine = Array.from({ length: last - first + 3 }, (_, k) => [1, 2, 5].map((m) => Number((m * 10 ** (first - 1 + k)).toPrecision(6)))).flat();
    return fine.filter((x) => x >= low * 0.999 && x <= high * 1.001);
  }
  const each = Math.max(1, Math.ceil((last - first + 1) / Math.max(1, count)));
  return Array.from({ length: Math.max(0, Math.floor((last - first) / each) + 1) }, (_, k) => 10 ** (first + k * each));
}

/** A scale from values to pixels. */
export interface Scale { (value: number): number; low: number; high: number; log: boolean }

export function scale(low: number, high: number, from: number, to: number, log: boolean): Scale {
  const at = log ? Math.log10 : (x: number) => x;
  const begin = at(low), span = at(high) - begin || 1;
  return Object.assign((value: number) => from + ((at(value) - begin) / span) * (to - from), { low, high, log });
}

/** Least and largest of what can be drawn, with some room; of a logarithmic scale whole powers of ten. */
export function extent(all: Iterable<ArrayLike<number | null>>, log: boolean): [number, number] {
  let low = Infinity, high = -Infinity;
  for (const values of all) {
    for (let k = 0; k < values.length; k++) {
      const x = values[k];
      if (x == null || !Number.isFinite(x) || (log && x <= 0)) continue;
      if (x < low) low = x;
      if (x > high) high = x;
    }
  }
  if (low > high) return log ? [0.1, 1] : [0, 1];
  if (log) return [10 ** Math.floor(Math.log10(low)), 10 ** Math.ceil(Math.log10(high) + 1e-9)].map((x, k, both) => (k && x === both[0] ? 10 * x : x)) as [number, number];
  const room = 0.06 * (high - low) || 0.06 * Math.abs(high) || 1;
  return [low - room, high + room];
}

const rounded = (x: number) => Math.round(100 * x) / 100;

/** A line through points, interrupted where there is none; in a column of pixels that holds many, from the least to the largest. */
export function path(xs: ArrayLike<number>, ys: ArrayLike<number | null>, x: Scale, y: Scale): string {
  let out = "", pen = "M", column = NaN, least = 0, largest = 0, last = 0, count = 0;
  const flush = () => {
    if (count > 1) out += `L${column} ${rounded(least)}L${column} ${rounded(largest)}L${column} ${rounded(last)}`;
    count = 0;
  };
  const dense = xs.length > 2 * Math.abs(x(x.high) - x(x.low));
  for (let k = 0; k < xs.length; k++) {
    const value = ys[k], at = xs[k]!;
    if (value == null || !Number.isFinite(value) || at < x.low || at > x.high || (y.log && value <= 0)) { flush(); pen = "M"; column = NaN; continue; }
    const px = dense ? Math.round(x(at)) : rounded(x(at)), py = y(Math.min(y.high, Math.max(y.low, value)));
    if (dense && px === column) { least = Math.min(least, py); largest = Math.max(largest, py); last = py; count += 1; continue; }
    flush();
    out += `${pen}${px} ${rounded(py)}`;
    pen = "L"; column = px; least = largest = last = py; count = 1;
  }
  flush();
  return out;
}

/** The place of what is nearest to a value in ascending ones. */
export function nearest(xs: ArrayLike<number>, value: number): number {
  let low = 0, high = xs.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (xs[middle]! < value) low = middle; else high = middle;
  }
  return Math.abs((xs[high] ?? Infinity) - value) < Math.abs((xs[low] ?? Infinity) - value) ? high : low;
}

/** A dot for each point within the plot. */
export function dots(xs: ArrayLike<number>, ys: ArrayLike<number | null>, x: Scale, y: Scale): string {
  let out = "";
  for (let k = 0; k < xs.length; k++) {
    const [at, value] = [xs[k]!, ys[k]];
    if (value == null || !(at >= x.low && at <= x.high && value >= y.low && value <= y.high)) continue;
    out += `M${rounded(x(at))} ${rounded(y(value))}h.01`;
  }
  return out;
}
