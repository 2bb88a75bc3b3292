// Points of curves, as they are drawn.
import type uPlot from "uplot";
import type { Window } from "./server";

/** Points of curves on the raster of the first: two per stretch, its least and its largest value. */
export function points(windows: (Window | null)[]): uPlot.AlignedData {
  const grid = windows.find((w) => w && w.least.length > 0);
  if (!grid) return [[], ...windows.map(() => [])];
  const count = grid.least.length, each = grid.samples > 1 ? 2 : 1;
  const xs = new Float64Array(each * count);
  for (let k = 0; k < count; k++) {
    xs[each * k] = grid.from + k * grid.step;
    if (each === 2) xs[2 * k + 1] = grid.from + (k + 0.5) * grid.step;
  }
  const series = windows.map((w) => {
    const ys: (number | null)[] = new Array(each * count).fill(null);
    if (!w) return ys;
    for (let k = 0; k < count; k++) {
      const from = w === grid ? k : Math.round((grid.from + k * grid.step - w.from) / w.step);
      const low = w.least[from], high = w.largest[from];
      if (low == null || high == null || Number.isNaN(low)) continue;
      ys[each * k] = low;
      if (each === 2) ys[2 * k + 1] = high;
    }
    return ys;
  });
  return [xs, ...series] as uPlot.AlignedData;
}
