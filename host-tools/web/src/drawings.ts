// What the panes and the maps show, as drawings.
import type { Map as Residual } from "./api";
import { extent, path, scale, ticks } from "./plotting";

export interface Curve { ys: ArrayLike<number | null>; colour: string; name: string; dash?: number[]; width?: number }
export interface Stacked { caption: string; xs: ArrayLike<number>; curves: Curve[] }
export interface Colours { ground: string; text: string; muted: string; grid: string }

const escaped = (text: string) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;").replaceAll('"', "&quot;");
const begun = (width: number, height: number, ground: string, title: string) =>
  `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}" font-family="system-ui, sans-serif" font-size="11"><title>${escaped(title)}</title><rect width="100%" height="100%" fill="${ground}"/>`;

const LEFT = 60, RIGHT = 10, HEAD = 20, FOOT = 24, CAPTION = 16;

/** Curves over time, pane below pane. */
export function stacked(title: string, panes: Stacked[], [from, to]: [number, number], width: number, each: number, c: Colours): string {
  const height = HEAD + panes.length * each + FOOT, x = scale(from, to, LEFT, width - RIGHT, false);
  let out = begun(width, height, c.ground, title) + `<text x="6" y="14" font-weight="bold" fill="${c.text}">${escaped(title)}</text>`;
  panes.forEach((pane, k) => {
    const top = HEAD + k * each, [low, high] = extent(pane.curves.map((curve) => curve.ys), false), y = scale(low, high, top + each - 4, top + CAPTION, false);
    for (const t of ticks(from, to, width / 90)) out += `<line x1="${x(t)}" x2="${x(t)}" y1="${top + CAPTION}" y2="${top + each - 4}" stroke="${c.grid}"/>`;
    for (const v of ticks(low, high, each / 30)) out += `<line x1="${LEFT}" x2="${width - RIGHT}" y1="${y(v)}" y2="${y(v)}" stroke="${c.grid}"/><text x="${LEFT - 4}" y="${y(v) + 3}" text-anchor="end" fill="${c.muted}">${v}</text>`;
    out += `<text x="${LEFT}" y="${top + 11}" fill="${c.text}">${escaped(pane.caption)}: ${pane.curves.map((curve) => `<tspan fill="${curve.colour}">${escaped(curve.name)}</tspan>`).join(", ")}</text>`;
    for (const curve of pane.curves) {
      const dash = curve.dash ? ` stroke-dasharray="${curve.dash.join(" ")}"` : "";
      out += `<path d="${path(pane.xs, curve.ys, x, y)}" fill="none" stroke="${curve.colour}" stroke-width="${curve.width ?? 1}"${dash}/>`;
    }
  });
  for (const t of ticks(from, to, width / 90)) out += `<text x="${x(t)}" y="${height - 8}" text-anchor="middle" fill="${c.muted}">${t} s</text>`;
  return `${out}</svg>`;
}

/** Cells of a map, each in its colour, with a stroke where the model is too low. */
export function cells(title: string, m: Residual, colour: (cell: number) => { fill: string; stroke: string | null } | null, c: Colours): string {
  const across = m.x.edges.length - 1, up = m.y.edges.length - 1, size = 16, left = 70, top = 24;
  const width = left + across * size + 12, height = top + up * size + 36;
  let out = begun(width, height, c.ground, title) + `<text x="6" y="15" font-weight="bold" fill="${c.text}">${escaped(title)}</text>`;
  for (let cell = 0; cell < across * up; cell++) {
    const drawn = colour(cell), x = left + (cell % across) * size, y = top + (up - 1 - Math.floor(cell / across)) * size;
    if (!drawn) continue;
    out += `<rect x="${x}" y="${y}" width="${size}" height="${size}" fill="${drawn.fill}"><title>${m.mean[cell]} ${escaped(m.unit)}, ${m.counts[cell]} samples</title></rect>`;
    if (drawn.stroke) out += `<line x1="${x}" y1="${y + size}" x2="${x + size}" y2="${y}" stroke="${drawn.stroke}" stroke-width=".7"/>`;
  }
  const number = (x: number | undefined) => String(Number((x ?? 0).toPrecision(3)));
  const bottom = top + up * size, text = (x: number, y: number, anchor: string, what: string) => `<text x="${x}" y="${y}" text-anchor="${anchor}" fill="${c.muted}">${escaped(what)}</text>`;
  out += text(left - 4, top + 10, "end", number(m.y.edges[up])) + text(left - 4, bottom, "end", number(m.y.edges[0])) + text(left - 4, (top + bottom) / 2, "end", `${m.y.name.split(" ")[0]}, ${m.y.unit}`);
  out += text(left, bottom + 14, "start", number(m.x.edges[0])) + text(left + across * size, bottom + 14, "end", number(m.x.edges[across])) + text(left + (across * size) / 2, bottom + 28, "middle", `${m.x.name}, ${m.x.unit}`);
  return `${out}</svg>`;
}

/** Cells of a map as a table. */
export function cellTable(m: Residual): string {
  const across = m.x.edges.length - 1, head = [`${m.x.name} from`, "to", `${m.y.name} from`, "to", `mean, ${m.unit}`, `rms, ${m.unit}`, "samples"];
  const rows = m.counts.flatMap((count, cell) => {
    const [i, j] = [cell % across, Math.floor(cell / across)];
    return count ? [[m.x.edges[i], m.x.edges[i + 1], m.y.edges[j], m.y.edges[j + 1], m.mean[cell], m.rms[cell]].map((x) => String(Number((x ?? 0).toPrecision(8)))).concat(String(count)).join(",")] : [];
  });
  return [head.map((h) => (h.includes(",") ? `"${h}"` : h)).join(","), ...rows, ""].join("\n");
}
