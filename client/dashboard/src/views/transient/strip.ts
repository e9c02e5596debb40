/** A strip of pictures: light at several times, side by side. */
import { fixed } from "../../ui/format";

const COLUMNS = 4;
export const PICTURES = 8;
const LABEL_PX = 12;
/** Share of the brightest moment's light from which a moment is worth a picture. */
const LEAST = 0.05;

/** Turns, 0 to 1, evenly over the times at which light arrives and no others; over all times where none does. */
export function turnsOf(arrivals: ArrayLike<number>, count = PICTURES): number[] {
  const all = Array.from(arrivals);
  const least = LEAST * Math.max(...all);
  const worth = all.flatMap((value, at) => (value > least && value > 0 ? [at] : []));
  const times = worth.length > 0 ? worth : all.map((_, at) => at);
  return Array.from({ length: count }, (_, n) => {
    const place = ((n + 0.5) / count) * times.length;
    return (times[Math.floor(place)] + (place % 1)) / all.length;
  });
}

/** From when to when there is light, in shares of the period, with a little dark around it; null where there is none. */
export function litOf(arrivals: ArrayLike<number>): { readonly first: number; readonly last: number } | null {
  const all = Array.from(arrivals);
  const least = LEAST * Math.max(...all);
  const worth = all.map((value) => value > least && value > 0);
  if (!worth.includes(true)) return null;
  const room = 0.02;
  return { first: Math.max(0, worth.indexOf(true) / all.length - room), last: Math.min(1, (worth.lastIndexOf(true) + 1) / all.length + room) };
}

/** Draws what `pictureAt` shows at each turn, with its time below. */
export function stripOf(turns: readonly number[], period_s: number, pictureAt: (turn: number) => HTMLCanvasElement | null): HTMLCanvasElement {
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
