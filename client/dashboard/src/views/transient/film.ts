/** Films of the light: one pass of it. */
import { rangeOfTime_m } from "../../physics/constants";
import type { Store } from "../../store/store";
import { figureLayout, figureSvg, timeWords } from "../../ui/figure";
import { type FigureParts, imageOf } from "../../ui/figureFiles";
import { type FilmKind, type Progress, recorderOf } from "../../ui/film";

/** Width of the picture in a film, in px. */
const PICTURE_PX = 490;
/** Pictures a second of one pass, and the most in it. */
const RATE_HZ = 20;
const MOST_PICTURES = 240;

/** What a film is made of: the picture now, and what is written around it. */
export type Subject = Readonly<{ snapshot: () => HTMLCanvasElement | null; parts: () => FigureParts }>;

/** The canvas of a film; `draw` brings it up to date. Null before there is a picture. */
async function plateOf({ snapshot, parts }: Subject, store: Store): Promise<{ canvas: HTMLCanvasElement; draw: () => void } | null> {
  const first = snapshot();
  if (first === null) return null;
  const [columns, rows] = [first.width, first.height];
  const layout = figureLayout(columns, rows, PICTURE_PX);
  // What changes from picture to picture is written with each.
  const frame = await imageOf(figureSvg({ ...parts(), title: "", caption: "", picture: null, columns, rows }, layout));
  const canvas = document.createElement("canvas");
  // Videos want even sizes.
  [canvas.width, canvas.height] = [layout.width + (layout.width % 2), layout.height + (layout.height % 2)];
  const context = canvas.getContext("2d", { willReadFrequently: true }) as CanvasRenderingContext2D;
  const draw = (): void => {
    const picture = snapshot();
    const { caption } = parts();
    context.fillStyle = "#000";
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.drawImage(frame, 0, 0);
    context.imageSmoothingEnabled = false;
    if (picture !== null) context.drawImage(picture, layout.left, layout.top, layout.pictureWidth, layout.pictureHeight);
    context.fillStyle = "#fff";
    context.font = '600 15px "Inter Variable", sans-serif';
    const time_s = store.player.time_s.peek();
    context.fillText(timeWords(time_s, rangeOfTime_m(time_s)), layout.left, layout.top - 10);
    context.font = '11px "Inter Variable", sans-serif';
    context.fillText(caption, layout.left, layout.height - 12);
  };
  return { canvas, draw };
}

/** One pass of the light over the frame on screen, as fast as it is played; null where it was cancelled. */
export async function filmPass(subject: Subject, store: Store, kind: FilmKind, progress: Progress): Promise<Blob | null> {
  const { player, held } = store;
  const before = { turn: player.turn.peek(), playing: player.playing.peek(), held: held.peek() };
  [player.playing.value, held.value] = [false, true];
  try {
    const { first, last } = player.lit.peek() ?? { first: 0, last: 1 };
    const lasts_s = ((last - first) * store.period_s.peek() * 1e9) / player.speed_ns.peek();
    const count = Math.max(2, Math.min(MOST_PICTURES, Math.round(lasts_s * RATE_HZ)));
    player.seek(first);
    const plate = await plateOf(subject, store);
    if (plate === null) return null;
    const recorder = await recorderOf(plate.canvas, kind);
    for (let n = 0; n < count; n++) {
      player.seek(first + (n / (count - 1)) * (last - first));
      plate.draw();
      await recorder.add(lasts_s / count);
      progress.report((n + 1) / count);
      if (progress.cancelled) break;
    }
    const film = await recorder.finish();
    return progress.cancelled ? null : film;
  } finally {
    [player.turn.value, player.playing.value, held.value] = [before.turn, before.playing, before.held];
  }
}
