/** What of a pixel can be shown. */
import { oneOf, type Setting } from "../../store/settings";

export type Aspect = "density" | "bounds" | "cumulative";
export type Side = Aspect | "moments";

type Words<T> = Readonly<{ value: T; text: string; hint: string }>;

export const ASPECTS: readonly Words<Aspect>[] = [
  { value: "density", text: "Density", hint: "The maximum entropy density" },
  { value: "bounds", text: "Bounds", hint: "What every density with these moments, smoothed, lies between" },
  { value: "cumulative", text: "Cumulative", hint: "Light up to each time of flight" },
];

export const SIDES: readonly Words<Side>[] = [
  ...ASPECTS,
  { value: "moments", text: "Moments", hint: "The trigonometric moments on the complex plane" },
];

export const SIDE: Setting<Side> = { key: "response.side", link: "side", initial: "bounds", ...oneOf(SIDES.map(({ value }) => value)) };
