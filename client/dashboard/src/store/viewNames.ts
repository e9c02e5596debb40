/** Names of all views, apart from the views themselves: the store knows them and no view. */
export const VIEW_NAMES = [
  "map",
  "second-map",
  "transient",
  "response",
  "plots",
  "streak",
  "points",
  "validity",
  "sequence",
  "series",
  "recordings",
  "reconstruction",
  "calibration",
  "simulation",
  "events",
] as const;

export type ViewName = (typeof VIEW_NAMES)[number];
