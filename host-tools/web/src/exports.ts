// What the panes show, as a file.
import type { Window } from "./server";

export interface Column { name: string; window: Window | null }

/** Columns of curves on the raster of the first; a curve whose stretches hold several samples has two. */
export function table(recording: string, columns: Column[]): string {
  const there = columns.filter((c): c is { name: string; window: Window } => c.window != null && c.window.least.length > 0);
  const grid = there[0]?.window;
  if (!grid) return "";
  const exact = grid.samples === 1;
  const head = [
    `# recording: ${recording.replaceAll(/[\r\n]/g, " ")}`,
    `# resolution: ${exact ? "every sample" : `least and largest of ${grid.samples} samples`}`,
    ["t_s", ...there.flatMap((c) => (exact ? [c.name] : [`${c.name}_least`, `${c.name}_largest`]))].join(","),
  ];
  const cell = (x: number | undefined) => (x == null || Number.isNaN(x) ? "" : String(Number(x.toPrecision(8))));
  const rows = Array.from({ length: grid.least.length }, (_, k) => {
    const t = grid.from + k * grid.step;
    const values = there.flatMap(({ window: w }) => {
      const at = Math.round((t - w.from) / w.step);
      return exact ? [cell(w.least[at])] : [cell(w.least[at]), cell(w.largest[at])];
    });
    return [String(Number(t.toPrecision(12))), ...values].join(",");
  });
  return [...head, ...rows, ""].join("\n");
}

export function save(name: string, content: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** The panes one below the other, with their captions. */
export function picture(panes: Element[], title: string): Promise<Blob | null> {
  const scale = devicePixelRatio, line = 18 * scale;
  const parts = panes.flatMap((pane) => {
    const canvas = pane.querySelector("canvas");
    return canvas ? [{ canvas, caption: pane.getAttribute("aria-label") ?? "" }] : [];
  });
  const out = document.createElement("canvas"), ctx = out.getContext("2d");
  out.width = Math.max(1, ...parts.map((p) => p.canvas.width));
  out.height = line + parts.reduce((sum, p) => sum + p.canvas.height + line, 0);
  if (!ctx) return Promise.resolve(null);
  const style = getComputedStyle(document.documentElement);
  ctx.fillStyle = style.getPropertyValue("--ground");
  ctx.fillRect(0, 0, out.width, out.height);
  ctx.fillStyle = style.getPropertyValue("--text");
  ctx.font = `${12 * scale}px system-ui, sans-serif`;
  ctx.fillText(title, 6 * scale, line * 0.75);
  let y = line;
  for (const { canvas, caption } of parts) {
    ctx.fillText(caption, 6 * scale, y + line * 0.75);
    ctx.drawImage(canvas, 0, y + line);
    y += canvas.height + line;
  }
  return new Promise((done) => out.toBlob(done));
}

/** Values of curves over an axis, a curve's own axis beside it where it is another one. */
export function columns(x: string, lines: { name: string; xs: ArrayLike<number>; ys: ArrayLike<number | null> }[]): string {
  const quoted = (text: string) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const own = lines.map((l, k) => k === 0 || l.xs !== lines[0]!.xs);
  const head = lines.flatMap((l, k) => (own[k] ? [k === 0 ? x : `${x} of ${l.name}`, l.name] : [l.name])).map(quoted).join(",");
  const cell = (v: number | null | undefined) => (v == null || !Number.isFinite(v) ? "" : String(Number(v.toPrecision(9))));
  const rows = Array.from({ length: Math.max(0, ...lines.map((l) => l.xs.length)) }, (_, n) =>
    lines.flatMap((l, k) => (own[k] ? [cell(l.xs[n]), cell(l.ys[n])] : [cell(l.ys[n])])).join(","));
  return [head, ...rows, ""].join("\n");
}

/** What a style sheet says of a drawing, which is not there where it goes. */
const STYLES = ["fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-linecap", "opacity", "font-size", "font-family", "font-weight", "text-anchor"];

/** A drawing that stands by itself. */
export function drawing(svg: SVGSVGElement): string {
  const copy = svg.cloneNode(true) as SVGSVGElement;
  const [from, to] = [[svg, ...svg.querySelectorAll<SVGElement>("*")], [copy, ...copy.querySelectorAll<SVGElement>("*")]];
  from.forEach((element, k) => {
    const style = getComputedStyle(element), made = to[k]!;
    made.removeAttribute("style");
    made.removeAttribute("class");
    made.removeAttribute("tabindex");
    if (element.tagName !== "title") for (const name of STYLES) made.setAttribute(name, style.getPropertyValue(name));
  });
  const [width, height] = [svg.width.baseVal.value, svg.height.baseVal.value];
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const ground = document.createElementNS("http://www.w3.org/2000/svg", "rect");
  ground.setAttribute("width", "100%");
  ground.setAttribute("height", "100%");
  ground.setAttribute("fill", getComputedStyle(document.documentElement).getPropertyValue("--ground"));
  copy.prepend(ground);
  return new XMLSerializer().serializeToString(copy);
}

/** How many pixels of a picture a pixel of a drawing makes. */
const FINE = 2;

/** A drawing as a file, by its ending SVG or PNG. */
export async function saveText(text: string, width: number, height: number, name: string): Promise<void> {
  const vector = new Blob([text], { type: "image/svg+xml" });
  if (name.endsWith(".svg")) { save(name, vector); return; }
  const address = URL.createObjectURL(vector), image = new Image();
  image.src = address;
  await image.decode();
  const out = document.createElement("canvas");
  out.width = FINE * width;
  out.height = FINE * height;
  out.getContext("2d")?.drawImage(image, 0, 0, out.width, out.height);
  URL.revokeObjectURL(address);
  const picture = await new Promise<Blob | null>((done) => out.toBlob(done));
  if (picture) save(name, picture);
}

export const saveDrawing = (svg: SVGSVGElement, name: string): Promise<void> =>
  saveText(drawing(svg), svg.width.baseVal.value, svg.height.baseVal.value, name);
