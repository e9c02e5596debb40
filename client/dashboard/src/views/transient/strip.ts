/** A strip of pictures: light at several times, side by side. */
import { fixed } from "../../scales/format";

const COLUMNS = 4;
export const PICTURES = 8;
const LABEL_PX = 12;
/** Draws what `pictureAt` shows at each turn, with its time below. */
export function stripOf(
  turns: readonly number[],
  period_s: number,
  pictureAt: (turn: number) => HTMLCanvasElement | null,
): HTMLCanvasElement {
  const strip = document.createElement("canvas");
  turns.forEach((turn, n) => {
    const picture = pictureAt(turn);
    if (picture === null) return;
    const height = picture.height + LABEL_PX + 2;
    if (n === 0) [strip.width, strip.height] = [COLUMNS * (picture.width + 2) - 2, Math.ceil(turns.length / COLUMNS) * height];
    const context = strip.getContext("2d");
    if (context === null) return;
    const [x, y] = [(n % COLUMNS) * (picture.width + 2), Math.floor(n / COLUMNS) * height];
    if (n === 0) {
      context.fillStyle = "#000";
      context.fillRect(0, 0, strip.width, strip.height);
    }
    context.drawImage(picture, x, y);
    context.fillStyle = "#fff";
    context.font = `${LABEL_PX - 2}px sans-serif`;
    context.fillText(fixed(turn * period_s * 1e9, 1, "ns"), x + 3, y + picture.height + LABEL_PX - 2);
  });
  return strip;
}
