// Orders of versions and of what was tried.
import type { Candidate, Version } from "./api";

/** What can be compared, with its symbol. */
export const SIGNALS = [["current", "i"], ["speed", "ω"], ["torque", "T"]] as const;

/** Versions in the order of a tree, each with its depth. */
export function tree(versions: Version[], parent: number | null = null, depth = 0): [Version, number][] {
  const known = new Set(versions.map((v) => v.id));
  const here = versions.filter((v) => (parent == null ? v.parent == null || !known.has(v.parent) : v.parent === parent));
  return here.flatMap((v, _, siblings) => {
    const further = siblings.length > 1 && parent != null ? depth + 1 : depth;
    return [[v, further] as [Version, number], ...tree(versions, v.id, parent == null ? depth : further)];
  });
}

/** From the first version to one, as far as they rest on the same recordings. */
export function ladder(versions: Version[], present: Version | null): Version[] {
  const steps: Version[] = [];
  for (let v: Version | undefined | null = present; v && v.basis === present?.basis; ) {
    steps.unshift(v);
    const parent: number | null = v.parent;
    v = parent == null ? null : versions.find((w) => w.id === parent);
  }
  return steps;
}

/** Candidates of the first step, best first, each once. */
export function tried(v: Version | null): Candidate[] {
  const all = v?.diagnosis?.candidates.filter((c) => c.step === 1) ?? [];
  return [...all].sort((a, b) => b.gain - a.gain).filter((c, k, sorted) => sorted.findIndex((other) => other.effect === c.effect) === k);
}
