// Numbers as an engineer reads them.

export const percent = (x: number | null | undefined): string =>
  x == null ? "–" : x >= 10 ? `${Number((100 * x).toPrecision(3)).toLocaleString()} %` : x >= 0.1 ? `${(100 * x).toFixed(1)} %` : x >= 0.001 ? `${(100 * x).toFixed(2)} %` : `${Number((100 * x).toPrecision(2))} %`;

const PREFIXES: [number, string][] = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]];

/** Significant digits, without an exponent where one can be avoided. */
export function rounded(x: number | null | undefined, digits = 4): string {
  if (x == null || !Number.isFinite(x)) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  return size < 1e-3 || size >= 1e6 ? x.toExponential(digits - 1) : Number(x.toPrecision(digits)).toLocaleString(undefined, { maximumSignificantDigits: digits });
}

/** A value with its unit and the prefix that leaves one to three digits before the point. */
export function withPrefix(x: number, unit: string, digits = 3): string {
  if (x === 0 || !Number.isFinite(x)) return `${x} ${unit}`;
  const [factor, prefix] = PREFIXES.find(([factor]) => Math.abs(x) >= factor) ?? [1e-9, "n"];
  return `${Number((x / factor).toPrecision(digits))} ${prefix}${unit}`;
}

export const frequency = (interval: number): string => withPrefix(1 / interval, "Hz");

export const seconds = (s: number): string => (s >= 60 ? `${Math.floor(s / 60)} min ${Math.round(s % 60)} s` : `${Number(s.toPrecision(3))} s`);
