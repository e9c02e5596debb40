import type { Zeroth } from "../../stream/protocol";

/** How the zeroth moment is had (Sec. 4.3), in words. */
export const ZEROTH_NAMES: Record<Zeroth, string> = {
  "low-frequency": "low frequency",
  "on-off": "light on − off",
  estimated: "estimated",
};

export const ZEROTH_COSTS: Record<Zeroth, string> = {
  "low-frequency": "four images more a take",
  "on-off": "two images more a take",
  estimated: "no images more",
};
