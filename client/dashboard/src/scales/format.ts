/** Numbers for people: a fixed count of decimals, a thin space before the unit, a dash for nothing. */

export const NOTHING = "–";
const THIN_SPACE = "\u202f";

const PREFIXES = Object.entries({ G: 1e9, M: 1e6, k: 1e3, "": 1, m: 1e-3, µ: 1e-6, n: 1e-9 });

export function withUnit(text: string, unit: string): string {
  return unit === "" || unit === "1" ? text : `${text}${THIN_SPACE}${unit}`;
}

/** `value` with `decimals` decimals. */
export function fixed(value: number | null | undefined, decimals: number, unit = ""): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return NOTHING;
  return withUnit(value.toFixed(decimals).replace("-", "−"), unit);
}

/** `value` with `digits` significant digits and the prefix that keeps them short: 0.0904 s -> 90.4 ms. */
export function engineering(value: number | null | undefined, unit: string, digits = 3): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return NOTHING;
  if (value === 0) return withUnit("0", unit);
  const size = Math.abs(value);
  const [prefix, factor] = PREFIXES.find(([, f]) => size >= f * 0.9995) ?? PREFIXES[PREFIXES.length - 1];
  // Rounding first: 999.9999 has as many digits before the point as 1000.
  const scaled = Number((value / factor).toPrecision(digits));
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(Math.abs(scaled)) + 1e-9));
  return withUnit(scaled.toFixed(decimals).replace("-", "−"), prefix + unit);
}

/** `value` with `digits` significant digits, without a prefix; powers of ten where it is far from one. */
export function significant(value: number | null | undefined, digits: number, unit = ""): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return NOTHING;
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e6 || size < 1e-4)) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return withUnit(`${mantissa}·10${superscript(Number(exponent))}`, unit);
  }
  const decimals = size === 0 ? 0 : Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return withUnit(value.toFixed(decimals).replace("-", "−"), unit);
}

/** A standard deviation behind its value: "± 11 mm"; "" where none is known. */
export function deviation(std: number | null | undefined, unit: string): string {
  if (std === null || std === undefined || !Number.isFinite(std)) return "";
  // Digital numbers take no prefix.
  return `±\u202f${unit === "m" || unit === "s" ? engineering(std, unit, 2) : significant(std, 2, unit)}`;
}

/** The number that is typed, with a decimal point or comma; NaN where it is none. */
export function numberOf(text: string): number {
  return text.trim() === "" ? NaN : Number(text.replace(",", "."));
}

/** A whole number with its thousands apart. */
export function grouped(value: number): string {
  return Math.round(value)
    .toString()
    .replace(/\B(?=(\d{3})+$)/g, THIN_SPACE);
}

export function superscript(exponent: number): string {
  const digits = "⁰¹²³⁴⁵⁶⁷⁸⁹";
  return String(exponent).replace(/./g, (sign) => (sign === "-" ? "⁻" : digits[Number(sign)]));
}

/** A time of day of 24 hours, where the reader is. */
export function timeOfDay(unix_s: number): string {
  return new Date(1000 * unix_s).toLocaleTimeString(undefined, { hourCycle: "h23" });
}
