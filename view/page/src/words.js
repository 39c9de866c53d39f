// Name motions between poses by the tool's position in them.
import { placed } from "./chain.js";

const WAYS = ["front", "left", "back", "right"];
const STRETCHED = 0.75, FOLDED = 0.5; // shares of the farthest pose's reach

/** @returns { first, last, words } for each motion; poses that look alike keep their names. */
export function motionsOf(chain, motions, poses) {
  const tools = Object.fromEntries(Object.entries(poses).map(([name, q]) => [name, placed(chain.frames(q, []).at(-1))]));
  const reach = (at) => Math.hypot(at.x, at.y, at.z);
  const farthest = Math.max(...Object.values(tools).map(reach));
  const shape = (at) => (reach(at) > STRETCHED * farthest ? "stretched" : reach(at) < FOLDED * farthest ? "folded" : "bent");
  const way = (at) => WAYS[((Math.round(Math.atan2(at.y, at.x) / (Math.PI / 2)) % 4) + 4) % 4];
  const seen = new Set();
  return motions.map(([first, last]) => {
    const [from, to] = [tools[first], tools[last]];
    let words = [shape(from), shape(to)];
    if (words[0] === words[1]) words = [way(from), way(to)];
    let text = words.join(" → ");
    if (words[0] === words[1] || seen.has(text)) text = `${first} → ${last}`;
    seen.add(text);
    return { first, last, words: text };
  });
}
