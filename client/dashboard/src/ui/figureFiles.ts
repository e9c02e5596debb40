/** Figures as files and as pictures: what needs a browser. */
import type { Action } from "./ActionMenu";
import { save, savePicture } from "./download";
import { type Figure, figureLayout, figureSvg, figures } from "./figure";

/** Width of a figure's picture, in px; a PNG has `PNG_SCALE` times as many. */
const FIGURE_PX = 640;
const PNG_SCALE = 2;

/** What a figure is made of, but for its picture, which is a canvas of the sensor's size. */
export type FigureParts = Omit<Figure, "picture" | "columns" | "rows">;

/**
 * Hands a figure of a canvas out, as canvas and words are when this is called: the light plays on while it is drawn.
 *
 * Of WebGL only in the task that drew it.
 */
async function saveFigure(name: string, canvas: HTMLCanvasElement | null, parts: FigureParts, kind: "png" | "svg"): Promise<void> {
  if (canvas === null) return;
  const [columns, rows] = [canvas.width, canvas.height];
  const layout = figureLayout(columns, rows, FIGURE_PX);
  const svg = figureSvg({ ...parts, columns, rows, picture: canvas.toDataURL("image/png") }, layout);
  // Pixel by pixel: a browser may smooth what is within an SVG.
  await saveDrawing(name, svg, layout, kind, (context) => {
    context.imageSmoothingEnabled = false;
    context.drawImage(canvas, layout.left, layout.top, layout.pictureWidth, layout.pictureHeight);
  });
}

/** Hands an SVG out, as it is or as a PNG; `paint` paints over that before this returns, and so before anything moves. */
export async function saveDrawing(
  name: string,
  svg: string,
  { width, height }: Readonly<{ width: number; height: number }>,
  kind: "png" | "svg",
  paint: (context: CanvasRenderingContext2D) => void = () => {},
): Promise<void> {
  if (kind === "svg") {
    save(`${name}.svg`, new Blob([svg], { type: "image/svg+xml" }));
    return;
  }
  const drawn = document.createElement("canvas");
  [drawn.width, drawn.height] = [PNG_SCALE * width, PNG_SCALE * height];
  const context = drawn.getContext("2d") as CanvasRenderingContext2D;
  context.scale(PNG_SCALE, PNG_SCALE);
  paint(context);
  context.globalCompositeOperation = "destination-over";
  context.drawImage(await imageOf(svg), 0, 0, width, height);
  const content = await new Promise<Blob | null>((done) => drawn.toBlob(done, "image/png"));
  if (content !== null) save(`${name}.png`, content);
}

/** What can be saved of a picture: as it is, and as a figure. It is asked for when it is saved, in the task that drew it. */
export function pictureFiles(name: () => string, canvas: () => HTMLCanvasElement | null, parts: () => FigureParts | null): Action[] {
  const figure = (kind: "png" | "svg") => (): void => {
    const words = parts();
    if (words !== null) void saveFigure(name(), canvas(), words, kind);
  };
  return [{ text: "Picture (PNG)", run: () => savePicture(name(), canvas()) }, ...figures(figure)];
}

/** An SVG as an image that can be drawn. */
export async function imageOf(svg: string): Promise<HTMLImageElement> {
  const address = URL.createObjectURL(new Blob([svg], { type: "image/svg+xml" }));
  try {
    const image = new Image();
    image.src = address;
    await image.decode();
    return image;
  } finally {
    URL.revokeObjectURL(address);
  }
}
