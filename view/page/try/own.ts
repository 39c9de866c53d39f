// The user's own shaper: amplitudes and delays as expressions in f_d and ζ, and their errors.
import type { Impulses, Shaper } from "./numbers/impulses.js";
import { decay } from "./numbers/impulses.js";
import { say } from "./words.js";

const MOST = 20, LONGEST = 5, EXACT = 1e-9;
const FUNCTIONS: Record<string, (x: number) => number> = { exp: Math.exp, sqrt: Math.sqrt, cos: Math.cos, sin: Math.sin, abs: Math.abs };

export type Field = "A" | "t";
export interface Refusal {
  field: Field;
  text: string;
  /** Sum of the amplitudes, if that is the only error. */
  sum?: number;
}

export class TypedError extends Error {}

type Expression = (values: Record<string, number>) => number;

/** An expression: numbers, names, + - * / ^, brackets, functions; a number before a name or bracket multiplies it. */
export function parse(text: string, names: readonly string[]): Expression {
  const tokens = text.match(/\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+|[A-Za-z_ζπ][\w]*|\S/g) ?? [];
  let at = 0;
  const wrong = (): never => {
    throw new TypedError(at < tokens.length ? say("wrong_text", { text: tokens[at] }) : say("wrong_end", { text: text.trim() }));
  };
  const sum = (): Expression => {
    let left = term();
    while (tokens[at] === "+" || tokens[at] === "-") {
      const before = left, sign = tokens[at++] === "+" ? 1 : -1, right = term();
      left = (v) => before(v) + sign * right(v);
    }
    return left;
  };
  const term = (): Expression => {
    let left = signed();
    for (;;) {
      const before = left, token = tokens[at];
      if (token === "*" || token === "/" || token === "·") {
        at++;
        const right = signed();
        left = token === "/" ? (v) => before(v) / right(v) : (v) => before(v) * right(v);
      } else if (token !== undefined && /^[A-Za-z_ζπ(]/.test(token)) {
        const right = power();
        left = (v) => before(v) * right(v);
      } else return left;
    }
  };
  const signed = (): Expression => {
    if (tokens[at] === "-" || tokens[at] === "−") {
      at++;
      const inner = signed();
      return (v) => -inner(v);
    }
    return power();
  };
  const power = (): Expression => {
    const base = atom();
    if (tokens[at] !== "^") return base;
    at++;
    const exponent = signed();
    return (v) => base(v) ** exponent(v);
  };
  const atom = (): Expression => {
    const token = tokens[at];
    if (token === undefined) return wrong();
    if (/^[\d.]/.test(token)) {
      const value = Number(token);
      if (!Number.isFinite(value)) return wrong();
      at++;
      return () => value;
    }
    if (token === "(") {
      at++;
      const inner = sum();
      if (tokens[at] !== ")") return wrong();
      at++;
      return inner;
    }
    if (Object.hasOwn(FUNCTIONS, token) && tokens[at + 1] === "(") {
      at++;
      const inner = atom();
      return (v) => FUNCTIONS[token](inner(v));
    }
    if (!names.includes(token)) return wrong();
    at++;
    return (v) => v[token];
  };
  const made = sum();
  if (at < tokens.length) wrong();
  return made;
}

function values(f_d: number, zeta: number): Record<string, number> {
  return { f_d, f: f_d, T: 1 / f_d, ζ: zeta, zeta, z: zeta, K: decay(zeta), π: Math.PI, pi: Math.PI };
}
const NAMES = Object.keys(values(1, 0));

function list(field: Field, text: string): Expression[] {
  const parts = text.replace(/[;\n]/g, ",").split(",").filter((part, i, all) => part.trim() !== "" || (i < all.length - 1 && all.length > 1));
  if (!parts.length) throw new TypedError(say(field === "A" ? "wrong_no_A" : "wrong_no_t"));
  if (parts.length > MOST) throw new TypedError(say("wrong_many", { most: MOST, count: parts.length }));
  return parts.map((part) => parse(part, NAMES));
}

const short = (value: number): string => String(+value.toPrecision(4)).replace("-", "−");

/** The shaper of two texts, or the first field's error, for a mode of f_d [Hz] and ζ [-]. */
export function typed(A: string, t: string, f_d: number, zeta: number): Shaper | Refusal {
  const made: Partial<Record<Field, Expression[]>> = {};
  for (const [field, text] of [["A", A], ["t", t]] as const) {
    try {
      made[field] = list(field, text);
    } catch (error) {
      if (!(error instanceof TypedError)) throw error;
      return { field, text: error.message };
    }
  }
  const [sizes, times] = [made.A!, made.t!];
  if (sizes.length !== times.length) return { field: "t", text: say("wrong_count", { A: sizes.length, t: times.length }) };
  const shaper: Shaper = (f, z) => {
    const v = values(f, z);
    return { A: sizes.map((one) => one(v)), tau: times.map((one) => one(v)) };
  };
  return judged(shaper(f_d, zeta)) ?? shaper;
}

function judged({ A, tau }: Impulses): Refusal | null {
  for (const [field, numbers] of [["A", A], ["t", tau]] as const) {
    if (!numbers.every(Number.isFinite)) return { field, text: say("wrong_infinite") };
  }
  const negative = tau.find((one) => one < 0);
  if (negative !== undefined) return { field: "t", text: say("wrong_negative", { t: short(negative) }) };
  if (tau[0] !== 0) return { field: "t", text: say("wrong_first", { t: short(tau[0]) }) };
  const early = tau.findIndex((one, j) => j > 0 && one < tau[j - 1]);
  if (early > 0) return { field: "t", text: say("wrong_order", { t: short(tau[early]), before: short(tau[early - 1]) }) };
  const last = tau[tau.length - 1];
  if (last > LONGEST) return { field: "t", text: say("wrong_long", { t: short(last), most: LONGEST }) };
  const sum = A.reduce((p, q) => p + q, 0);
  if (Math.abs(sum) < EXACT) return { field: "A", text: say("wrong_zero") };
  if (Math.abs(sum - 1) >= EXACT) return { field: "A", text: say("wrong_sum", { sum: short(sum) }), sum };
  return null;
}
