/** A picture as a figure: with axes, colour bar, unit and words, as SVG that stands by itself. */

import { type ColourMapName, colourTable, LEVELS, levelOf } from "../scales/colourMaps";
import { engineering, fixed, significant, withUnit } from "../scales/format";
import { decimalsFor, fraction, niceStep, type Scale, ticks } from "../scales/scale";
import { multiplesWords } from "../store/events";
import { sentWords } from "../store/frames";
import type { AppliedDocument, FrameDocument, FrameMeta } from "../stream/documents";
import type { Action } from "./ActionMenu";

export interface Figure {
  /** The picture as an address that stands in the file; null leaves its place empty. */
  readonly picture: string | null;
  /** Its size in pixels of the sensor. */
  readonly columns: number;
  readonly rows: number;
  readonly title: string;
  readonly caption: string;
  /** Of the colour bar; null where colours stand for no number. */
  readonly scale: Scale | null;
  readonly colours: ColourMapName;
  readonly unit: string;
  readonly ground: "black" | "white";
  /** What its sides are where they are not rows and columns: a time from 0 to this in ns downwards, or nothing, of a view in space. */
  readonly sides?: number | "space";
}

/** Sizes in px of the figure, and the place of the picture in it. */
type FigureLayout = ReturnType<typeof figureLayout>;

const MARGINS = { left: 46, top: 30, right: 92, bottom: 66 } as const;
const BAR_PX = 14;
const TICK_PX = 4;

/** A picture of whole times its pixels, about `wide` px wide, with margins. */
export function figureLayout(columns: number, rows: number, wide: number) {
  const zoom = Math.max(1, Math.round(wide / columns));
  const [pictureWidth, pictureHeight] = [columns * zoom, rows * zoom];
  const { left, top, right, bottom } = MARGINS;
  return { width: left + pictureWidth + right, height: top + pictureHeight + bottom, left, top, pictureWidth, pictureHeight };
}

/** What was measured with, in a line, and which pixels were. */
export function captionOf(
  meta: FrameMeta | FrameDocument,
  applied: AppliedDocument | null,
  notes: Readonly<Record<string, string>> = {},
): string {
  const { harmonics, base_frequency_hz, zeroth, exposure_s, takes, calibration_id, estimator, frame } = meta;
  const measured = multiplesWords(harmonics, applied?.sequence_id === meta.sequence_id ? applied?.sampling : null);
  const sequence = `${measured}, ${engineering(base_frequency_hz, "Hz", 4)}, b₀ ${zeroth.replaceAll("_", " ")}, ${engineering(exposure_s, "s")} × ${takes}`;
  const written = Object.entries(notes)
    .map(([place, note]) => `; ${place}: ${note}`)
    .join("");
  const sent = "decimation" in meta ? sentWords(meta) : "";
  return `${sequence}; ${estimator}; calibration ${calibration_id || "none"}; frame ${frame}${sent && `, ${sent}`}${written}`;
}

export function figureSvg(figure: Figure, layout: FigureLayout): string {
  const { width, height, left, top, pictureWidth, pictureHeight } = layout;
  const { sides, scale } = figure;
  const ink = figure.ground === "black" ? "#e4e9ee" : "#1a2129";
  const right = left + pictureWidth;
  const picture =
    figure.picture === null
      ? ""
      : `<image x="${left}" y="${top}" width="${pictureWidth}" height="${pictureHeight}" preserveAspectRatio="none" style="image-rendering:pixelated" href="${figure.picture}"/>`;
  const parts = [
    `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}" font-family="Inter, Helvetica, Arial, sans-serif" font-size="12" fill="${ink}">`,
    `<rect width="${width}" height="${height}" fill="${figure.ground === "black" ? "#000" : "#fff"}"/>`,
    text(left, top - 11, figure.title, 'font-size="14" font-weight="600"'),
    picture,
    `<rect x="${left - 0.5}" y="${top - 0.5}" width="${pictureWidth + 1}" height="${pictureHeight + 1}" fill="none" stroke="${ink}"/>`,
    ...(sides === "space" ? [] : axes(figure, layout, sides, ink)),
    scale === null ? "" : bar({ ...figure, scale }, right + 12, top, pictureHeight, ink),
    text(left, height - 12, figure.caption, 'font-size="11"'),
    "</svg>",
  ];
  return parts.join("\n");
}

/** Both sides with round numbers and what they count. */
function axes({ columns, rows }: Figure, layout: FigureLayout, end_ns: number | undefined, ink: string): string[] {
  const { left, top, pictureWidth, pictureHeight } = layout;
  const foot = top + pictureHeight;
  const times = end_ns === undefined ? [] : ticks({ low: 0, high: end_ns, kind: "linear" }, 8);
  const down = end_ns === undefined ? axis(rows, 6) : times.map((time_ns) => ({ pixel: time_ns, share: time_ns / end_ns }));
  const name = end_ns === undefined ? "row (pixels)" : "time of flight (ns)";
  return [
    ...axis(columns, 8).map(({ pixel, share }) => mark(left + share * pictureWidth, foot, "down", String(pixel), ink)),
    ...down.map(({ pixel, share }) => mark(left, top + share * pictureHeight, "left", String(pixel), ink)),
    text(left + pictureWidth / 2, foot + 32, "column (pixels)", 'text-anchor="middle"'),
    `<text transform="translate(12 ${top + pictureHeight / 2}) rotate(-90)" text-anchor="middle">${name}</text>`,
  ];
}

/** Round pixels along an axis, each marked at its middle. */
function axis(pixels: number, count: number): { readonly pixel: number; readonly share: number }[] {
  return ticks({ low: 0, high: pixels - 1, kind: "linear" }, count)
    .filter((pixel) => Number.isInteger(pixel))
    .map((pixel) => ({ pixel, share: (pixel + 0.5) / pixels }));
}

function bar({ scale, colours, unit }: Figure & { readonly scale: Scale }, x: number, top: number, height: number, ink: string): string {
  const table = colourTable(colours);
  const stops = Array.from({ length: 33 }, (_, n) => {
    const level = 4 * Math.min(LEVELS - 1, levelOf(n / 32));
    return `<stop offset="${n / 32}" stop-color="rgb(${table[level]},${table[level + 1]},${table[level + 2]})"/>`;
  });
  const decimals = decimalsFor(niceStep(scale.high - scale.low, 6));
  const write = (value: number): string => (scale.kind === "linear" ? fixed(value, decimals) : significant(value, 2));
  return [
    `<linearGradient id="bar" x1="0" y1="1" x2="0" y2="0">${stops.join("")}</linearGradient>`,
    `<rect x="${x}" y="${top}" width="${BAR_PX}" height="${height}" fill="url(#bar)" stroke="${ink}"/>`,
    ...ticks(scale, 6).map((value) => mark(x + BAR_PX, top + (1 - fraction(scale, value)) * height, "right", write(value), ink)),
    unit === "1" ? "" : text(x, top - 11, unit),
  ].join("");
}

function mark(x: number, y: number, to: "down" | "left" | "right", words: string, ink: string): string {
  const [dx, dy] = { down: [0, TICK_PX], left: [-TICK_PX, 0], right: [TICK_PX, 0] }[to];
  const line = `<path d="M${x} ${y}l${dx} ${dy}" stroke="${ink}"/>`;
  if (to === "down") return line + text(x, y + 16, words, 'text-anchor="middle"');
  return line + text(x + 1.75 * dx, y + 4, words, to === "left" ? 'text-anchor="end"' : "");
}

/** Words of an SVG, whatever stands in them. */
export function text(x: number, y: number, words: string, attributes = ""): string {
  return `<text x="${x}" y="${y}" ${attributes}>${words.replace(/&/g, "&amp;").replace(/</g, "&lt;")}</text>`;
}

/** A time of flight and the range it stands for, for titles. */
export function timeWords(time_s: number, range_m: number): string {
  return `${withUnit((time_s * 1e9).toFixed(2), "ns")} (${withUnit(range_m.toFixed(2), "m")})`;
}

/** A figure in both of its kinds. */
export function figures(run: (kind: "png" | "svg") => () => void): Action[] {
  return [
    { text: "Figure (PNG)", run: run("png") },
    { text: "Figure (SVG)", run: run("svg") },
  ];
}
