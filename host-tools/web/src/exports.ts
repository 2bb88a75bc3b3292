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
