/** Plots as figures that stand by themselves, in the colours of the page: whatever draws a plot, it is saved here. */
import type uPlot from "uplot";
import { text } from "./figure";
import { saveDrawing } from "./figureFiles";

/** What is written around a plot, and the name of its file. */
export type PlotWords = Readonly<{ name: string; title: string; caption: string }>;

/** Hands a plot out: one of uPlot, or an SVG of the page. */
export function savePlot(root: Element, plot: uPlot | undefined, { name, title, caption }: PlotWords, kind: "png" | "svg"): void {
  const { width, height } = root.getBoundingClientRect();
  const style = getComputedStyle(root.closest(".panel") ?? root);
  const size = { width: Math.ceil(Math.max(width, LETTER_PX * caption.length) + 2 * EDGE), height: Math.ceil(height + HEAD + FOOT) };
  const svg = [
    `<svg xmlns="http://www.w3.org/2000/svg" width="${size.width}" height="${size.height}" viewBox="0 0 ${size.width} ${size.height}" font-family="Inter, Helvetica, Arial, sans-serif" font-size="12" fill="${style.color}">`,
    `<rect width="100%" height="100%" fill="${style.backgroundColor}"/>`,
    text(EDGE, HEAD - 14, title, 'font-size="14" font-weight="600"'),
    `<g transform="translate(${EDGE} ${HEAD})">${plot === undefined ? styledSvg(root) : plotSvg(plot)}</g>`,
    text(EDGE, size.height - 10, caption, 'font-size="11"'),
    "</svg>",
  ];
  void saveDrawing(name, svg.join("\n"), size, kind);
}

const [EDGE, HEAD, FOOT] = [12, 34, 52];
/** Room of a letter of the caption, and of the name of a line. */
const [LETTER_PX, NAME_PX] = [6, 90];

/** What the style sheets of the page say of shapes and words. */
const STYLES = ["fill", "stroke", "stroke-width", "stroke-dasharray", "vector-effect", "opacity", "font-size", "font-weight"];

/** An SVG of the page, which keeps its looks without the style sheets. */
function styledSvg(root: Element): string {
  const copy = root.cloneNode(true) as Element;
  const [shown, kept] = [root, copy].map((each) => [...each.querySelectorAll("*")]);
  shown.forEach((element, n) => {
    const style = getComputedStyle(element);
    for (const name of STYLES) kept[n].setAttribute(name, style.getPropertyValue(name));
  });
  const { width, height } = root.getBoundingClientRect();
  for (const [name, px] of Object.entries({ width, height })) copy.setAttribute(name, String(px));
  return new XMLSerializer().serializeToString(copy);
}

/** What uPlot knows of an axis once it has drawn it. */
type DrawnAxis = uPlot.Axis & { readonly _splits?: readonly number[]; readonly _values?: readonly (string | null)[] };

/** A plot of uPlot with vectors: axes, grid, bands, lines and what its hooks draw. */
function plotSvg(plot: uPlot): string {
  const [left, top, wide, high] = [plot.bbox.left, plot.bbox.top, plot.bbox.width, plot.bbox.height].map((each) => each / devicePixelRatio);
  const foot = top + high;
  const colour = (of: unknown, at: number): string => String((typeof of === "function" ? of(plot, at) : of) ?? "none");
  const place = (x: number, y: number): string =>
    `${(left + plot.valToPos(x, "x")).toFixed(2)} ${(top + plot.valToPos(y, "y")).toFixed(2)}`;
  const [along, ...lines] = plot.data;
  const points = (values: uPlot.AlignedData[number]): string[] =>
    Array.from(along, (x, n) => (values[n] == null ? "" : place(x, values[n]))).map((each) => (/NaN|Inf/.test(each) ? "" : each));
  const pathOf = (all: readonly string[]): string => all.map((each, n) => each && `${all[n - 1] ? "L" : "M"}${each}`).join("");
  const axes = plot.axes.flatMap((axis: DrawnAxis, at) => {
    const { side, grid, label, scale = at === 0 ? "x" : "y", _splits: splits = [], _values: words = [] } = axis;
    const across = side === 3;
    const ink = colour(axis.stroke, at);
    const marks = splits.map((value, n) => {
      const shift = plot.valToPos(value, scale);
      const [x, y] = across ? [left, top + shift] : [left + shift, side === 0 ? top : foot];
      const line =
        grid?.show === false ? "" : `<path d="M${x} ${y}${across ? `h${wide}` : `v${-high}`}" stroke="${colour(grid?.stroke, at)}"/>`;
      const [dx, dy, anchor] = across ? [-8, 4, "end"] : [0, side === 0 ? -8 : 16, "middle"];
      return line + text(x + dx, y + dy, words[n] ?? "", `fill="${ink}" text-anchor="${anchor}"`);
    });
    const named = across
      ? `transform="translate(10 ${top + high / 2}) rotate(-90)"`
      : `transform="translate(${left + wide / 2} ${foot + 32})"`;
    return [...marks, text(0, 0, typeof label === "string" ? label : "", `${named} fill="${ink}" text-anchor="middle"`)];
  });
  const bands = (plot as uPlot & { readonly bands: readonly uPlot.Band[] }).bands.map(({ series: [upper, lower], fill }, at) => {
    const [up, down] = [upper, lower].map((n) => points(plot.data[n]).filter(Boolean));
    return `<path d="${pathOf([...up, ...down.reverse()])}Z" fill="${colour(fill, at)}"/>`;
  });
  const drawn = lines.map((values, n) => {
    const { stroke, fill, width, dash, label } = plot.series[n + 1];
    const all = points(values);
    const there = all.filter(Boolean);
    const ink = colour(stroke, n + 1);
    const [first, last] = [there[0], there.at(-1)].map((each) => each?.split(" ")[0]);
    const below =
      there.length < 2 || !fill ? "" : `<path d="${pathOf(there)}L${last} ${foot}L${first} ${foot}Z" fill="${colour(fill, n + 1)}"/>`;
    const line = `<path d="${pathOf(all)}" fill="none" stroke="${ink}" stroke-width="${width}" stroke-dasharray="${dash?.join(" ") ?? "none"}"/>`;
    const name = there.length > 0 && typeof label === "string" && label !== "Value" ? label : "";
    return [below + line, text(left + NAME_PX * n, plot.height + 14, name, `fill="${ink}"`)] as const;
  });
  const paths: string[] = [];
  let path = "";
  const nothing = (): void => {}; // all is cut at the plot's edge
  const pen = {
    canvas: { height: 0 },
    strokeStyle: "",
    lineWidth: 1,
    beginPath: () => (path = ""),
    moveTo: (x: number, y: number) => (path += `M${x} ${y}`),
    lineTo: (x: number, y: number) => (path += `L${x} ${y}`),
    stroke: () => paths.push(`<path d="${path}" stroke="${pen.strokeStyle}" stroke-width="${pen.lineWidth}"/>`),
    ...{ save: nothing, restore: nothing, rect: nothing, clip: nothing, setLineDash: nothing },
  };
  const onPaper = Object.create(plot, { ctx: { value: pen } });
  for (const draw of (plot.hooks.draw ?? []) as ((drawn: uPlot) => void)[]) draw(onPaper);
  return [
    ...axes,
    `<clipPath id="inside"><rect x="${left}" y="${top - 4}" width="${wide}" height="${high + 8}"/></clipPath>`,
    `<g clip-path="url(#inside)">${bands.join("")}${drawn.map(([line]) => line).join("")}`,
    `<g transform="scale(${1 / devicePixelRatio})" fill="none">${paths.join("")}</g></g>`,
    ...drawn.map(([, name]) => name),
  ].join("");
}
