// Colours by sign and size: hue and lightness, and a stroke below zero.

export const css = (name: string): string => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function mixed(low: string, high: string, share: number): string {
  const parts = (colour: string) => [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16));
  const [a, b] = [parts(low), parts(high)];
  return `rgb(${a.map((x, k) => Math.round(x + ((b[k] ?? 0) - x) * share)).join(" ")})`;
}

/** Fill, and stroke through it, of values up to the strongest. */
export function cellFill(strongest: number): (value: number) => { fill: string; stroke: string | null } {
  const [low, middle, high] = ["--low", "--middle", "--high"].map(css) as [string, string, string];
  return (value) => {
    const share = Math.min(1, Math.abs(value) / strongest);
    return { fill: mixed(middle, value < 0 ? low : high, share ** 0.7), stroke: value < 0 && share > 0.12 ? (share > 0.5 ? middle : low) : null };
  };
}
