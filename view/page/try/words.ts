// The page's texts, from the one file that a translation replaces.
import words from "./words.json";

export type Key = keyof typeof words;

/** A text, with {names} in it replaced by values. */
export function say(key: Key, values: Record<string, string | number> = {}): string {
  return words[key].replace(/\{(\w+)\}/g, (whole, name: string) => (name in values ? String(values[name]) : whole));
}

export const percent = (share: number): string => (share < 0.00995 ? (100 * share).toFixed(1) : (100 * share).toFixed(0));
