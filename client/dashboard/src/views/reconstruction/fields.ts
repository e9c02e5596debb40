/** A form made of what the service says can be set: texts as they are typed, and what they stand for. */

import { numberOf, withUnit } from "../../scales/format";
import type { ParameterDocument } from "../../stream/documents";

export type Draft = Readonly<Record<string, string>>;

/** What a draft stands for; or which field does not stand for anything, and why. */
export type Reading = { readonly settings: Record<string, unknown> } | { readonly wrong: string; readonly words: string };

export function draftOf(parameters: readonly ParameterDocument[]): Draft {
  return Object.fromEntries(parameters.map(({ name, value }) => [name, String(value)]));
}

export function readingOf(parameters: readonly ParameterDocument[], draft: Draft): Reading {
  const settings: Record<string, unknown> = {};
  for (const parameter of parameters) {
    const { name, type, allowed } = parameter;
    const text = (draft[name] ?? "").trim();
    if (allowed !== null) {
      settings[name] = allowed.find((each) => String(each) === text) ?? text;
    } else if (type === "boolean") {
      settings[name] = text === "true";
    } else if (isNumber(parameter)) {
      const value = numberOf(text);
      const whole = type !== "integer" || Number.isInteger(value);
      if (!Number.isFinite(value) || !whole || value < (parameter.min ?? -Infinity) || value > (parameter.max ?? Infinity)) {
        return { wrong: name, words: `${labelOf(name)} must be ${limitsOf(parameter)}.` };
      }
      settings[name] = value;
    } else {
      settings[name] = text;
    }
  }
  return { settings };
}

export function isNumber({ type }: ParameterDocument): boolean {
  return type === "number" || type === "integer";
}

/** "from 0 to 10 px" */
export function spanOf(parameter: ParameterDocument): string {
  const { min, max } = parameter;
  const written = (value: number): string => String(Number(value.toPrecision(3)));
  const end = unitOf(parameter);
  if (min !== null && max !== null) return `from ${written(min)} to ${withUnit(written(max), end)}`;
  if (min !== null) return `at least ${withUnit(written(min), end)}`;
  return max === null ? "" : `at most ${withUnit(written(max), end)}`;
}

/** "a number from 0 to 10 px" */
function limitsOf(parameter: ParameterDocument): string {
  return `${parameter.type === "integer" ? "an integer" : "a number"} ${spanOf(parameter)}`.trim();
}

const LABELS: Readonly<Record<string, string | undefined>> = {
  neighbours: "Neighbours",
  still_frames: "Frames where still",
  smoothing_px: "Smoothing",
  bias: "Bias",
  return_threshold: "Threshold of a return",
  estimator: "Range by",
  minimum_brightness_dn: "Least brightness",
  spoilt_images: "Corrupt images",
};

/** A name for people: the page's own, or the service's without its unit. */
export function labelOf(name: string): string {
  const known = LABELS[name];
  if (known !== undefined) return known;
  const words = name.replace(/_(px|dn|s|hz|m|rad|deg|c)$/, "").replaceAll("_", " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}

const UNITS: Readonly<Record<string, string | undefined>> = { dn: "DN", "1": "" };

export function unitOf({ unit }: ParameterDocument): string {
  return UNITS[unit ?? "1"] ?? unit ?? "";
}
